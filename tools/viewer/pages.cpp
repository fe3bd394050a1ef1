#include "tools/viewer/pages.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/files/output_file.h"
#include "base/process/seconds.h"
#include "base/text/path_text.h"
#include "base/text/text.h"
#include "integrators/methods/read_scene.h"
#include "scenes/description/check_scene.h"
#include "scenes/outputs/picture_outputs.h"

namespace tensorray {
namespace {

constexpr std::size_t max_requests = 32;  // Of one page, waiting.
constexpr int coarsest = 16;
constexpr auto idle = std::chrono::milliseconds(100);  // Before what no page asked for is made.
constexpr double soon = 0.1, very_soon = 0.03;  // Seconds that a first picture may take, and that allow a finer one.

const std::vector<std::string> request_types{"scene", "look", "space", "save", "export"};

PageMessage text_message(Json message) {
  return {false, false, message.dump(-1, ' ', false, Json::error_handler_t::replace)};
}

PageMessage binary_message(const Json& header, const std::string& bytes, bool is_picture) {
  const std::string text = header.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string data;
  for (int i = 0; i < 4; ++i) data += static_cast<char>(text.size() >> (8 * i) & 0xff);
  return {true, is_picture, data + text + bytes};
}

PageMessage error_message(const Json& id, const std::string& text) {
  // The JSON library begins its messages with a name in brackets.
  const std::size_t end = starts_with(text, "[json.exception") ? text.find("] ") : std::string::npos;
  const std::string reason = end == std::string::npos ? text : "a message has a wrong part: " + text.substr(end + 2);
  return text_message({{"type", "error"}, {"id", id}, {"message", one_line(reason)}});
}

Json answer_to(const Json& request, const char* type, Json content) {
  Json message{{"type", type}, {"id", request.value("id", Json())}};
  message.update(content);
  return message;
}

/// @param scene, field  What all pages begin with, whatever scene another page sees by then.
Json hello(const ViewedScene& viewed, const Json& scene, const Json& field) {
  return {{"type", "hello"},
          {"version", TENSORRAY_VERSION},
          {"scene", scene},
          {"field", field},
          {"schema", Json::parse(scene_schema())},
          {"file", viewed.file.string()},
          {"command", viewed.command},
          {"saves", viewed.copy.string()}};
}

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The message as an object with a known type.
Json parsed(const std::string& text) {
  Json message;
  try {
    message = parse_value(text);
  } catch (const Json::exception&) {
    throw std::invalid_argument("a message is not JSON");
  }
  if (!message.is_object() || !message.contains("type") || !message["type"].is_string())
    throw std::invalid_argument("a message has no `type`");
  const std::string type = message["type"];
  if (std::find(request_types.begin(), request_types.end(), type) == request_types.end())
    throw std::invalid_argument("unknown message `" + printable(type) + "`; there are " + joined(request_types));
  constexpr std::size_t longest = 1 << 16;
  if (type != "scene" && type != "save" && text.size() > longest)
    throw std::invalid_argument("the message `" + type + "` is too long");
  if ((type == "scene" || type == "save") && !(message.contains("scene") && message["scene"].is_object()))
    throw std::invalid_argument("the message `" + type + "` has no `scene`");
  return message;
}

double number(const Json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_number())
    throw std::invalid_argument(fmt::format("the message has no number `{}`", key));
  return found->get<double>();
}

}  // namespace

Pages::Pages(const ViewedScene& viewed, const Progress& progress)
    : viewed_(viewed),
      scene_(scene_json(viewed.file, viewed.overrides, !viewed.imported.empty())),
      allowed_(resolved_files(read(scene_))),
      live_(viewed.file, viewed.imported) {
  const SceneDescription description = read(scene_);
  require_distinct_files(input_files(description), {{viewed.copy, "the file that a page saves to"}});
  live_.load(scene_, outputs_of(description, {}, folder_ / ""), progress);
  field_ = describe_field(live_.scene());
  thread_ = std::thread([this] { work(); });
}

Pages::~Pages() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
    progress_.cancelled = true;
  }
  wake_.notify_all();
  thread_.join();
}

Pages::Id Pages::open(Send send) {
  const auto page = std::make_shared<Page>();
  page->send = std::move(send);
  page->requests.push_back({"hello", Json::object(), false});
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    page->id = next_id_++;
    pages_.push_back(page);
  }
  wake_.notify_all();
  return page->id;
}

void Pages::close(Id id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  pages_.remove_if([&](const PagePointer& page) { return page->id == id; });
  if (rendering_.page && rendering_.page->id == id) progress_.cancelled = true;
}

void Pages::receive(Id id, const std::string& text) {
  Json message, message_id;
  std::string wrong;
  try {
    message = parsed(text);  // Before the lock: other pages do not wait for a long message.
  } catch (const std::exception& error) {
    wrong = error.what();
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found =
      std::find_if(pages_.begin(), pages_.end(), [&](const PagePointer& page) { return page->id == id; });
  if (found == pages_.end()) return;
  Page& page = **found;
  try {
    if (!wrong.empty()) throw std::invalid_argument(wrong);
    message_id = message.value("id", Json());
    const std::string type = message["type"];
    if (type == "scene") {
      page.scene = Request{type, std::move(message), false};
      if (rendering_.page == *found && !rendering_.is_first) progress_.cancelled = true;
    } else {
      if (page.requests.size() >= max_requests) throw std::invalid_argument("too many requests are waiting");
      page.requests.push_back({type, std::move(message), page.scene.has_value()});
    }
  } catch (const std::exception& error) {
    page.send(error_message(message_id, error.what()));
  }
  wake_.notify_all();
}

/// The first page with something to do; it goes to the end of the list. Null: the thread ends.
Pages::PagePointer Pages::next_page() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    if (ends_) return nullptr;
    for (auto page = pages_.begin(); page != pages_.end(); ++page) {
      const PagePointer chosen = *page;
      if (chosen->requests.empty() && !chosen->scene && chosen->stages.empty()) continue;
      pages_.splice(pages_.end(), pages_, page);
      return chosen;
    }
    wake_.wait(lock);
  }
}

void Pages::work() {
  while (const PagePointer page = next_page()) {
    try {
      serve(page);
    } catch (...) {  // There was no memory even for the message of an error: the page gets nothing, others go on.
      page->stages.clear();
    }
  }
}

void Pages::serve(const PagePointer& page) {
  std::optional<Request> scene;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    scene.swap(page->scene);
    for (Request& request : page->requests) request.waits = false;
  }
  if (scene) begin_scene(*page, *scene);
  if (!page->stages.empty()) make_stage(page);
  answer_requests(page, false);
}

SceneDescription Pages::read(const Json& scene) const {
  return read_scene_json(scene, viewed_.file, {{}, {}, {}, viewed_.imported});
}

void Pages::check(const Json& scene) const {
  const SceneDescription description = read(scene);
  const Json::json_pointer pointer("/field/file");
  const Json file = scene.value(pointer, Json());
  if (!viewed_.imported.empty() && !file.is_null() && file != scene_.value(pointer, Json()))
    throw SceneError("`/field/file`: this view shows " + viewed_.file.string() +
                     "; start another one for another file");
  require_files(description, allowed_);
  require_moderate(description);
}

void Pages::begin_scene(Page& page, const Request& request) {
  const Json id = request.message.value("id", Json());
  const bool was_finished = std::exchange(page.is_finished, false);
  page.stages.clear();
  try {
    const Json& scene = request.message["scene"];
    check(scene);
    const SceneDescription description = read(scene);
    const Method& method = description.integrator.method();
    const bool has_light = was_finished && differ_in(method.analysis_keys(), page.shown, scene);
    page.shown = scene;
    page.shown_id = id;
    page.landed.reset();
    page.stages = stages_of(coarseness_, method.is_sampled());
    const auto is_there = [&](const Stage& stage) {
      return stage.is_final() &&
             (has_light || live_.has_picture(page.shown, outputs_of(description, stage, folder_ / "")));
    };
    // Where only colours change, or what is seen of light that is traced, only the finished picture is sent again.
    const auto first = std::find_if(page.stages.begin(), page.stages.end(), is_there);
    if (first == page.stages.end()) return;
    page.stages.erase(page.stages.begin(), first);
    page.stages.front().is_known = false;
  } catch (const std::exception& error) {
    page.send(error_message(id, error.what()));
  }
}

/// Loads the scene that the page shows, for a stage.
void Pages::load_for(Page& page, const Stage& stage) {
  const SceneDescription description = read(page.shown);
  const auto outputs = outputs_of(description, stage, folder_ / "");
  if (description.receiver.resolution) {
    plate_.resolution = *description.receiver.resolution;
  } else if (stage.coarseness > 1 && plate_.scene != page.shown) {
    // It follows from the size of the plate, which the scene may leave open, too.
    plate_.resolution = live_.load(page.shown, outputs, progress_).geometry.surfaces().plate->resolution;
    plate_.scene = page.shown;
  }
  live_.load(at_stage(page.shown, description, plate_.resolution, stage), outputs, progress_);
}

/// Makes the page's next picture. A new scene of the page cancels all but the first.
void Pages::make_stage(const PagePointer& page) {
  const Stage stage = page->stages.front();
  page->stages.pop_front();
  const bool is_first = stage.is_first();
  {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto is_asked = [&] {  // Or the page is closed.
      return ends_ || std::find(pages_.begin(), pages_.end(), page) == pages_.end() ||
             std::any_of(pages_.begin(), pages_.end(),
                         [](const PagePointer& any) { return any->scene || !any->requests.empty(); });
    };
    if (stage.is_known && wake_.wait_for(lock, idle, is_asked)) return page->stages.push_front(stage);
    if (page->scene && !is_first) return;
    progress_.cancelled = ends_;
    rendering_ = {page, is_first};
  }
  const std::shared_ptr<void> end(nullptr, [&](void*) { end_work(); });  // However this function ends.
  auto last = Clock::now();
  bool is_loaded = false;  // Before, the scene is that of the last picture, perhaps of another page.
  progress_.report = [&](const std::string& phase, std::uint64_t done, std::uint64_t total) {
    if (is_first || seconds_since(last) < 0.2) return;
    last = Clock::now();
    if (!stage.is_known)
      page->send(text_message(
          {{"type", "progress"}, {"id", page->shown_id}, {"phase", phase}, {"done", done}, {"total", total}}));
    if (is_loaded) answer_requests(page, true);
  };
  try {
    const auto start = Clock::now();
    load_for(*page, stage);
    is_loaded = true;
    const double seconds_loading = seconds_since(start);
    page->render = live_.render(progress_);
    page->is_finished = stage.is_final();
    if (stage.is_known)
      page->send(text_message({{"type", "details"}, {"id", page->shown_id}}));
    else
      send_picture(*page, stage, seconds_loading);
    if (is_first && seconds_since(start) > soon) coarseness_ = std::min(2 * coarseness_, coarsest);
    if (is_first && seconds_since(start) < very_soon) coarseness_ = std::max(coarseness_ / 2, 2);
  } catch (const Cancelled&) {
    page->stages.clear();
  } catch (const std::exception& error) {
    page->stages.clear();
    page->send(error_message(page->shown_id, error.what()));
  }
}

void Pages::end_work() {
  const std::lock_guard<std::mutex> lock(mutex_);
  rendering_ = {};
  progress_.report = {};
  progress_.cancelled = ends_;
}

void Pages::send_picture(Page& page, const Stage& stage, double seconds_loading) {
  const Scene& scene = live_.scene();
  const Render& render = *page.render;
  auto start = Clock::now();
  page.display = display_image(scene, render, false, stage.coarseness);
  const Statistics& statistics = render.statistics;
  Json phases{{"load", seconds_loading},
              {"trace", statistics.seconds_tracing},
              {"light", statistics.seconds_density + statistics.seconds_drawing},
              {"color", statistics.seconds_color + seconds_since(start)}};
  start = Clock::now();
  const std::vector<unsigned char> png = encode_for_screen(page.display);
  phases["encode"] = seconds_since(start);
  double seconds = 0;
  for (const Json& phase : phases) seconds += phase.get<double>();
  const Json header{{"type", "picture"},
                    {"id", page.shown_id},
                    {"stage", stage.is_first()   ? 0
                              : stage.is_final() ? 2
                                                 : 1},
                    {"final", stage.is_final()},
                    {"width", page.display.width},
                    {"height", page.display.height},
                    {"full_width", page.display.width * stage.coarseness},
                    {"full_height", page.display.height * stage.coarseness},
                    {"format", "image/png"},
                    {"seconds", seconds},
                    {"phases", phases},
                    {"chosen", describe_choices(scene, render)},
                    {"examples", describe_examples(scene)},
                    {"notes", scene.notes},
                    {"warnings", render.warnings}};
  page.send(binary_message(header, {png.begin(), png.end()}, true));
}

/// @param renders  Whether a picture of this page is being made: only requests that need no other scene are answered.
void Pages::answer_requests(const PagePointer& page, bool renders) {
  const auto is_possible = [&](const Request& request) {
    return !request.waits && (!renders || request.type == "look" || request.type == "space");
  };
  for (;;) {
    Request request;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      const auto next = std::find_if(page->requests.begin(), page->requests.end(), is_possible);
      if (next == page->requests.end()) return;
      request = std::move(*next);
      page->requests.erase(next);
    }
    try {
      if (!renders && page->shown.is_object()) load_for(*page, {1, 0, true});  // It may be another page's scene.
      answer(page, request);
    } catch (const Cancelled&) {
      page->send(error_message(request.message.value("id", Json()), "another scene came before it was made"));
    } catch (const std::exception& error) {
      page->send(error_message(request.message.value("id", Json()), error.what()));
    }
  }
}

void Pages::answer(const PagePointer& pointer, const Request& request) {
  Page& page = *pointer;
  if (request.type == "hello") page.send(text_message(hello(viewed_, scene_, field_)));
  if (request.type == "look") look(page, request.message);
  if (request.type == "space") space(page, request.message);
  if (request.type == "save") save(page, request.message);
  if (request.type == "export") export_file(pointer, request.message);
}

void Pages::look(Page& page, const Json& message) {
  if (!page.render || page.display.pixels.empty()) throw std::invalid_argument("there is no picture yet");
  const Image &picture = page.render->linear, &shown = page.display;  // Which may have a legend beside the picture.
  const Eigen::Vector2d place(number(message, "x") * shown.width / picture.width,
                              number(message, "y") * shown.height / picture.height);
  const Scene& scene = live_.scene();
  Json content = describe_pixel(*page.render, page.display, place);
  content["rays"] = Json::array();
  if (scene.description.integrator.method().shows_plate()) {
    if (!page.landed) page.landed = std::make_shared<const LandedRays>(scene);
    content["rays"] = page.landed->to(scene, place);
  }
  page.send(text_message(answer_to(message, "look", std::move(content))));
}

void Pages::space(Page& page, const Json& message) {
  if (!page.shown.is_object()) throw std::invalid_argument("there is no scene yet");
  Json meshes_of{page.shown.value("obstacles", Json()), page.shown.value("world", Json()),
                 page.shown.value("field", Json::object()).value("bounds", Json())};
  Json content = describe_space(live_.scene(), page.meshes_of != meshes_of);
  content["field"] = describe_field(live_.scene());
  page.meshes_of = std::move(meshes_of);
  page.send(text_message(answer_to(message, "space", std::move(content))));
}

void Pages::save(Page& page, const Json& message) {
  check(message["scene"]);
  if (viewed_.copy.empty())
    throw std::invalid_argument("a scene needs a field that stays; make it with `tensorray import`, and view that");
  require_no_device(viewed_.copy);
  OutputFile file(viewed_.copy);
  file.write_text(message["scene"].dump(2) + "\n");
  file.commit();
  page.send(text_message(answer_to(message, "saved", {{"file", viewed_.copy.string()}})));
}

/// Sends the picture as a file, as `tensorray render` would write it.
void Pages::export_file(const PagePointer& pointer, const Json& message) {
  Page& page = *pointer;
  const std::string ending = "." + message.value("file", "");
  if (ending != ".png" && ending != ".exr") throw std::invalid_argument("a page can have `png` and `exr`");
  if (!page.shown.is_object()) throw std::invalid_argument("there is no picture yet");
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (page.scene) throw Cancelled();
    progress_.cancelled = ends_;
    rendering_ = {pointer, false};
  }
  const std::shared_ptr<void> end(nullptr, [&](void*) { end_work(); });  // However this function ends.
  const std::shared_ptr<const Render> render = live_.render(progress_);
  const std::filesystem::path file = folder_ / ("export" + ending);
  for (const Output& output : picture_outputs())
    if (std::find(output.endings.begin(), output.endings.end(), ending) != output.endings.end())
      output.write(file, live_.scene(), *render);
  std::filesystem::path name = std::filesystem::weakly_canonical(viewed_.file).filename();  // Of a folder, "." too.
  if (lower_case_ending(name) == ".gz") name.replace_extension();
  if (!std::filesystem::is_directory(viewed_.file)) name.replace_extension();
  name += ending;
  page.send(binary_message(answer_to(message, "file", {{"name", text_of_path(name)}}), bytes_of(file), false));
}

}  // namespace tensorray
