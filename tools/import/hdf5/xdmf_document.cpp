#include "tools/import/hdf5/xdmf_document.h"

#include <algorithm>
#include <cstdlib>
#include <unordered_set>
#include <utility>

#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include "base/errors.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

using Element = vtkXMLDataElement;
using Elements = std::vector<Element*>;

std::string name_of(Element& element) { return element.GetName() ? element.GetName() : ""; }

/// One part of a path: a name or *, and what stands in brackets.
struct PathStep {
  std::string name;
  std::vector<std::string> conditions;
  bool anywhere_below = false;  ///< After //.
};

/// Divides at slashes that are outside of brackets.
std::vector<PathStep> steps_of(const std::string& xpath) {
  std::vector<PathStep> steps;
  bool anywhere = false;
  for (std::size_t i = 0; i < xpath.size();) {
    if (xpath[i] == '/') {
      anywhere = i + 1 < xpath.size() && xpath[i + 1] == '/';
      i += anywhere ? 2 : 1;
      continue;
    }
    PathStep step;
    step.anywhere_below = std::exchange(anywhere, false);
    while (i < xpath.size() && xpath[i] != '/' && xpath[i] != '[') step.name += xpath[i++];
    while (i < xpath.size() && xpath[i] == '[') {
      const std::size_t end = std::min(xpath.find(']', i), xpath.size());
      step.conditions.push_back(xpath.substr(i + 1, end - i - 1));
      i = std::min(end + 1, xpath.size());
    }
    steps.push_back(step);
  }
  return steps;
}

constexpr std::size_t max_elements = 1u << 20;  // That a path or a collection may name.

constexpr int deepest = 16;  // Where each includes two others, there are 65,536 then.

void require_few(const std::filesystem::path& path, std::size_t elements) {
  if (elements > max_elements) fail(path, "its paths or grids name more than a million of others; write it again");
}

void add_below(Element& element, Elements& all) {
  for (int i = 0; i < element.GetNumberOfNestedElements(); ++i) {
    all.push_back(element.GetNestedElement(i));
    add_below(*element.GetNestedElement(i), all);
  }
}

/// Keeps what fulfils a condition: a number, an attribute's value, or names.
Elements filtered(const Elements& elements, const std::string& condition) {
  Elements kept;
  if (!condition.empty() && condition.find_first_not_of("0123456789") == std::string::npos) {
    const std::size_t number = std::strtoul(condition.c_str(), nullptr, 10);
    if (number >= 1 && number <= elements.size()) kept.push_back(elements[number - 1]);
    return kept;
  }
  for (Element* const element : elements) {
    if (condition.compare(0, 1, "@") == 0) {
      const std::size_t equals = condition.find('=');
      if (equals == std::string::npos || equals + 3 > condition.size()) continue;
      const std::string value = condition.substr(equals + 2, condition.size() - equals - 3);  // between quotation marks
      const char* const text = element->GetAttribute(condition.substr(1, equals - 1).c_str());
      if (text && value == text) kept.push_back(element);
    } else {
      const std::size_t at = condition.find("self::" + name_of(*element));
      const std::size_t end = at + 6 + name_of(*element).size();
      if (at != std::string::npos && (end == condition.size() || condition[end] == ' ')) kept.push_back(element);
    }
  }
  return kept;
}

}  // namespace

std::string xml_attribute(Element& element, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (const char* const text = element.GetAttribute(name)) return text;
  return {};
}

XdmfDocument::XdmfDocument(const std::filesystem::path& path)
    : path_(path), root_(vtkSmartPointer<Element>::Take(vtkXMLUtilities::ReadElementFromFile(path.c_str()))) {
  if (!root_) fail(path, "is damaged or cut off: it is no XML; copy or write it again");
  if (name_of(*root_) != "Xdmf") fail(path, "is no XDMF: its root is " + escaped(name_of(*root_)));
  for (Element* const domain : children(*root_, {"Domain"}))
    for (Element* const grid : children(*domain, {"Grid"})) {
      std::vector<std::vector<Element*>> steps;
      add_steps(*grid, steps, 0);
      if (steps.size() > 1 && steps_.size() > 1 && steps.size() != steps_.size())
        fail(path, "has grids with " + std::to_string(steps_.size()) + " and with " + std::to_string(steps.size()) +
                       " steps of time; write each to a file of its own");
      if (steps.size() > 1 && steps_.size() == 1) {  // A mesh without time stands before its functions.
        const std::vector<Element*> always = steps_.front();
        steps_.assign(steps.size(), always);
      }
      steps_.resize(std::max(steps_.size(), steps.size()));
      for (std::size_t i = 0; i < steps_.size() && !steps.empty(); ++i) {
        const std::vector<Element*>& more = steps[std::min(i, steps.size() - 1)];
        steps_[i].insert(steps_[i].end(), more.begin(), more.end());
      }
    }
  if (steps_.empty()) fail(path, "has no grid; write it again");
}

std::vector<Element*> XdmfDocument::children(Element& element, const std::vector<std::string>& names) const {
  std::vector<Element*> result;
  for (int i = 0; i < element.GetNumberOfNestedElements(); ++i) {
    Element& nested = *element.GetNestedElement(i);
    if (std::find(names.begin(), names.end(), name_of(nested)) != names.end()) result.push_back(&nested);
    if (!ends_with(name_of(nested), ":include")) continue;  // The prefix is a matter of the writer.
    std::string pointer = xml_attribute(nested, {"xpointer"});
    const std::size_t open = pointer.find('('), close = pointer.rfind(')');
    if (xml_attribute(nested, {"href"}) != "" || open == std::string::npos || close == std::string::npos ||
        close < open)
      fail(path_, "includes another file, or by an xpointer of another kind: " + escaped(pointer));
    for (Element* const included : find(pointer.substr(open + 1, close - open - 1), *root_))
      if (std::find(names.begin(), names.end(), name_of(*included)) != names.end()) result.push_back(included);
  }
  return result;
}

std::vector<Element*> XdmfDocument::find(const std::string& xpath, Element& from) const {
  const bool is_absolute = xpath.compare(0, 1, "/") == 0;
  Elements here{is_absolute ? root_.Get() : &from};
  bool at_root = is_absolute;  // The root itself is a child of the document.
  for (const PathStep& step : steps_of(xpath)) {
    Elements next;
    std::unordered_set<Element*> known;
    std::size_t looked_at = 0;
    for (Element* const element : here) {
      Elements candidates;
      if (at_root) candidates.push_back(element);
      if (step.anywhere_below) add_below(*element, candidates);
      if (!at_root && !step.anywhere_below)
        for (int i = 0; i < element->GetNumberOfNestedElements(); ++i)
          candidates.push_back(element->GetNestedElement(i));
      Elements named;
      for (Element* const candidate : candidates)
        if (step.name == "*" || step.name == name_of(*candidate)) named.push_back(candidate);
      for (const std::string& condition : step.conditions) named = filtered(named, condition);
      for (Element* const one : named)
        if (known.insert(one).second) next.push_back(one);
      require_few(path_, looked_at += candidates.size());
    }
    here = next;
    at_root = false;
  }
  return here;
}

/// A collection in time has one step for each of its grids; all others have one step.
void XdmfDocument::add_steps(Element& grid, std::vector<std::vector<Element*>>& steps, int depth) const {
  if (depth > deepest) fail(path_, "its grids are in others more than sixteen deep; write it again");
  const std::string type = lower_case(xml_attribute(grid, {"GridType"})),
                    collection = lower_case(xml_attribute(grid, {"CollectionType"}));
  if (type != "collection" && type != "tree") {
    steps.push_back({&grid});
    return;
  }
  for (Element* const inner : children(grid, {"Grid"})) {
    std::vector<std::vector<Element*>> of_inner;
    add_steps(*inner, of_inner, depth + 1);
    if (of_inner.empty()) continue;
    if (type == "collection" && collection == "temporal") {
      steps.push_back(of_inner.front());
    } else {
      steps.resize(std::max(steps.size(), of_inner.size()));
      for (std::size_t i = 0; i < steps.size(); ++i) {
        const auto& more = of_inner[std::min(i, of_inner.size() - 1)];
        steps[i].insert(steps[i].end(), more.begin(), more.end());
      }
    }
    for (const std::vector<Element*>& step : steps) require_few(path_, step.size());
  }
}

}  // namespace tensorray
