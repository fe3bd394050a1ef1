#include "tools/import/vtk/vtk_messages.h"

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include <fcntl.h>
#include <unistd.h>
#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkOutputWindow.h>

namespace tensorray {
namespace {

/// "ERROR: In FILE, line N\nvtkClass (0x55...): TEXT\n\n" → "TEXT", on one line.
std::string plain_text(std::string message) {
  if (const std::size_t position = message.find("): "); position != std::string::npos) {
    message.erase(0, position + 3);
  } else if (const std::size_t line = message.find('\n'); message.find(": In ") < line) {
    message.erase(0, line + 1);
  }
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; };
  std::replace_if(message.begin(), message.end(), is_control, ' ');
  constexpr std::size_t longest = 300;  // VTK's messages may quote the bytes of damaged files
  if (message.size() > longest) message = message.substr(0, longest) + " ...";
  while (!message.empty() && (message.back() == ' ' || message.back() == '.')) message.pop_back();
  return message;
}

unsigned long observe(vtkCommand::EventIds event, VtkMessages& messages) {
  vtkNew<vtkCallbackCommand> command;
  command->SetClientData(&messages);
  command->SetCallback([](vtkObject*, unsigned long kind, void* target, void* text) {
    if (!text) return;
    static_cast<VtkMessages*>(target)->keep(static_cast<const char*>(text), kind == vtkCommand::ErrorEvent);
  });
  return vtkOutputWindow::GetInstance()->AddObserver(event, command);
}

}  // namespace

VtkMessages::VtkMessages()
    : error_observer_(observe(vtkCommand::ErrorEvent, *this)),
      warning_observer_(observe(vtkCommand::WarningEvent, *this)),
      display_mode_(vtkOutputWindow::GetInstance()->GetDisplayMode()),
      verbosity_(vtkLogger::GetCurrentVerbosityCutoff()) {
  vtkOutputWindow::GetInstance()->SetDisplayMode(vtkOutputWindow::NEVER);
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
#ifndef TENSORRAY_SANITIZED
  std::fflush(stderr);
  if (const Descriptor nowhere = open_file("/dev/null", O_WRONLY); nowhere.is_open()) {
    stderr_ = Descriptor(fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3));
    if (stderr_.is_open()) dup2(nowhere.get(), STDERR_FILENO);
  }
#endif
}

VtkMessages::~VtkMessages() {
  vtkOutputWindow* const window = vtkOutputWindow::GetInstance();
  window->RemoveObserver(error_observer_);
  window->RemoveObserver(warning_observer_);
  window->SetDisplayMode(display_mode_);
  vtkLogger::SetStderrVerbosity(vtkLogger::ConvertToVerbosity(verbosity_));
  if (!stderr_.is_open()) return;
  std::fflush(stderr);
  dup2(stderr_.get(), STDERR_FILENO);
}

void VtkMessages::keep(const char* message, bool is_error) {
  const std::string text = plain_text(message);
  // VTK writes the range of an array as such a key, and cannot read it back if all its numbers are NaN.
  if (text.compare(0, 29, "Error reading InformationKey ") == 0) return;
  // The legacy readers only warn when a file ends too early, and continue with numbers that they have not read.
  const bool is_grave = is_error || text.find("rror reading") != std::string::npos;
  std::string& first = is_grave ? error_ : warning_;
  if (first.empty()) first = text;
}

void VtkMessages::throw_error(const std::filesystem::path& path) const {
  if (!error_.empty()) throw std::runtime_error(path.string() + ": VTK cannot read it: " + error_);
}

}  // namespace tensorray
