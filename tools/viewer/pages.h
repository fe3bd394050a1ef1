#pragma once
/// The pages that look at a scene, and the one thread that renders for them.

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "base/files/temporary_folder.h"
#include "base/process/progress.h"
#include "scenes/keys/json_reader.h"
#include "tools/viewer/answers.h"
#include "tools/viewer/stages.h"

namespace tensorray {

/// A message to a page.
struct PageMessage {
  bool is_binary = false;
  bool is_picture = false;  ///< A newer picture may replace it while it waits.
  std::string data;  ///< Text: JSON. Binary: the length of a JSON header (4 bytes, little endian), it, and bytes.
};

/// What is shown, and where "save" writes.
struct ViewedScene {
  std::filesystem::path file;
  std::vector<std::string> overrides;
  std::filesystem::path copy;             ///< Pages may save their scene to this file; empty: they may not.
  std::vector<std::string> command = {};  ///< What renders the scene from any folder: the program and its arguments.
  std::filesystem::path imported = {};    ///< The field that was made of `file` (SceneChanges); empty: it is a scene.
};

/// Answers the messages of all pages (their protocol: tools/viewer/page/src/state/protocol.ts). One thread renders, for
/// one page after another, a stage at a time. A page's newest scene replaces its older ones: their coarse pictures are
/// finished, everything finer is cancelled.
class Pages {
 public:
  /// Any thread calls it; it must not wait.
  using Send = std::function<void(PageMessage)>;
  using Id = std::uint64_t;

  /// Reads and loads the scene. @throw As read_scene and load_scene; also if `copy` is one of the scene's files.
  Pages(const ViewedScene& viewed, const Progress& progress);
  ~Pages();

  /// A new page; it is sent "hello".
  Id open(Send send);
  void close(Id page);

  /// A message of a page. Errors are sent to it. It does not wait for the answer.
  void receive(Id page, const std::string& text);

 private:
  struct Request {
    std::string type;
    Json message;
    bool waits = false;  ///< For a scene that came before it.
  };
  struct Page {
    Id id = 0;
    Send send;
    std::deque<Request> requests;              ///< To be answered.
    std::optional<Request> scene;              ///< The newest scene, until its stages begin.
    std::deque<Stage> stages;                  ///< Of `shown`, still to be made.
    Json shown, shown_id;                      ///< The scene of the last picture, and the id of its message.
    Json meshes_of;                            ///< The keys of the meshes that the page has.
    std::shared_ptr<const LandedRays> landed;  ///< Of `shown`, if a pixel of it was asked for.
    std::shared_ptr<const Render> render;      ///< The last picture, ...
    Image display;                             ///< ... and as the page shows it.
    bool is_finished = false;                  ///< Whether that is the finished picture of `shown`.
  };
  /// The resolution of a plate, in the finished picture of a scene.
  struct KnownPlate {
    Eigen::Vector2i resolution{1, 1};
    Json scene;
  };
  using PagePointer = std::shared_ptr<Page>;
  /// What is being made, a stage or an export: the page's end cancels it, and a new scene does, unless it is the first
  /// stage.
  struct Rendering {
    PagePointer page;
    bool is_first = false;
  };

  void work();
  PagePointer next_page();
  void serve(const PagePointer& page);
  void begin_scene(Page& page, const Request& request);
  void make_stage(const PagePointer& page);
  void answer_requests(const PagePointer& page, bool renders);
  void answer(const PagePointer& pointer, const Request& request);
  void look(Page& page, const Json& message);
  void space(Page& page, const Json& message);
  void save(Page& page, const Json& message);
  void export_file(const PagePointer& pointer, const Json& message);
  void end_work();
  void send_picture(Page& page, const Stage& stage, double seconds_loading);
  void load_for(Page& page, const Stage& stage);
  SceneDescription read(const Json& scene) const;
  void check(const Json& scene) const;

  const ViewedScene viewed_;
  Json scene_, field_;                       ///< The scene that all pages begin with, and the description of its field.
  std::set<std::filesystem::path> allowed_;  ///< Files that scenes of pages may name.
  TemporaryFolder folder_;
  LiveScene live_;
  int coarseness_ = 8;  ///< Of first pictures; it follows the time that they take.
  KnownPlate plate_;

  std::mutex mutex_;  ///< Guards what follows, and `requests` and `scene` of pages.
  std::condition_variable wake_;
  std::list<PagePointer> pages_;  ///< The next one to be served is the first.
  Id next_id_ = 1;
  bool ends_ = false;
  Rendering rendering_;
  Progress progress_;  ///< Of the present render.
  std::thread thread_;
};

}  // namespace tensorray
