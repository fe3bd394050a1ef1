#include "tools/import/hdf5/xdmf_document.h"

#include <algorithm>

#include <fcntl.h>
#include <libxml/parser.h>
#include <libxml/tree.h>
#include <libxml/xpath.h>

#include "base/errors.h"
#include "base/files/descriptor.h"
#include "base/text/text.h"

namespace tensorray {
namespace {

using Element = XmlElement;

constexpr std::size_t max_grids = 1u << 20;           // Of a step.
constexpr int deepest_grid = 16;                      // Where each includes two others, there are 65,536 then.
constexpr unsigned long max_operations = 10'000'000;  // Of one path.

std::string name_of(const Element& element) { return reinterpret_cast<const char*>(element.name); }

std::string taken(xmlChar* text) {
  const std::string result = text ? reinterpret_cast<const char*>(text) : "";
  xmlFree(text);
  return result;
}

/// Adds the grids of each step of `added`, which has some, to the same step of others; its last ones also to later
/// steps.
void add_beside(const std::vector<std::vector<Element*>>& added, std::vector<std::vector<Element*>>& steps) {
  steps.resize(std::max(steps.size(), added.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const std::vector<Element*>& more = added[std::min(i, added.size() - 1)];
    steps[i].insert(steps[i].end(), more.begin(), more.end());
  }
}

}  // namespace

std::string xml_attribute(Element& element, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (xmlHasProp(&element, BAD_CAST name)) return taken(xmlGetProp(&element, BAD_CAST name));
  return {};
}

std::string xml_text(Element& element) {
  const std::string text = taken(xmlNodeGetContent(&element));
  const std::size_t begin = std::min(text.find_first_not_of(" \t\r\n"), text.size());
  return text.substr(begin, text.find_last_not_of(" \t\r\n") + 1 - begin);
}

XdmfDocument::XdmfDocument(const std::filesystem::path& path) : path_(path) {
  // Entities that are other files, which may be pipes, are not there.
  xmlSetExternalEntityLoader([](const char*, const char*, xmlParserCtxtPtr) -> xmlParserInputPtr { return nullptr; });
  const Descriptor file = open_file(path, O_RDONLY);
  constexpr int options = XML_PARSE_NOENT | XML_PARSE_NOERROR | XML_PARSE_NOWARNING | XML_PARSE_NONET | XML_PARSE_HUGE;
  document_.reset(xmlReadFd(file.get(), nullptr, nullptr, options), xmlFreeDoc);
  Element* const top = document_ ? xmlDocGetRootElement(document_.get()) : nullptr;
  if (!top) fail(path, "is damaged or cut off: it is no XML; copy or write it again");
  if (name_of(*top) != "Xdmf") fail(path, "is no XDMF: its root is " + escaped(name_of(*top)));
  for (Element* const domain : children(*top, {"Domain"}))
    for (Element* const grid : children(*domain, {"Grid"})) {
      Steps steps;
      add_steps(*grid, steps, 0);
      if (steps.size() > 1 && steps_.size() > 1 && steps.size() != steps_.size())
        fail(path, "has grids with " + std::to_string(steps_.size()) + " and with " + std::to_string(steps.size()) +
                       " steps of time; write each to a file of its own");
      if (steps.size() > 1 && steps_.size() == 1) {  // A mesh without time stands before its functions.
        const std::vector<Element*> always = steps_.front();
        steps_.assign(steps.size(), always);
      }
      if (!steps.empty()) add_beside(steps, steps_);
    }
  if (steps_.empty()) fail(path, "has no grid; write it again");
}

std::vector<Element*> XdmfDocument::children(Element& element, const std::vector<std::string>& names) const {
  std::vector<Element*> result;
  const auto add = [&](Element* candidate) {
    if (std::find(names.begin(), names.end(), name_of(*candidate)) != names.end()) result.push_back(candidate);
  };
  for (Element* nested = element.children; nested; nested = nested->next) {
    if (nested->type != XML_ELEMENT_NODE) continue;
    add(nested);
    if (name_of(*nested) != "include" && !ends_with(name_of(*nested), ":include")) continue;
    const std::string pointer = xml_attribute(*nested, {"xpointer"});
    const std::size_t open = pointer.find('('), close = pointer.rfind(')');
    if (xml_attribute(*nested, {"href"}) != "" || open == std::string::npos || close == std::string::npos ||
        close < open)
      fail(path_, "includes another file, or by an xpointer of another kind: " + escaped(pointer));
    for (Element* const included : find(pointer.substr(open + 1, close - open - 1), element)) add(included);
  }
  return result;
}

std::vector<Element*> XdmfDocument::find(const std::string& xpath, Element& from) const {
  // Of several //, libxml2 takes minutes in a file of a few hundred elements.
  if (xpath.find("//") != xpath.rfind("//"))
    fail(path_, "has a path with several //, which is not read: " + escaped(xpath));
  const std::unique_ptr<xmlXPathContext, decltype(&xmlXPathFreeContext)> context(xmlXPathNewContext(document_.get()),
                                                                                 &xmlXPathFreeContext);
  context->node = &from;
  context->opLimit = max_operations;
  const std::unique_ptr<xmlXPathObject, decltype(&xmlXPathFreeObject)> found(
      xmlXPathEvalExpression(BAD_CAST xpath.c_str(), context.get()), &xmlXPathFreeObject);
  std::vector<Element*> elements;
  for (int i = 0; found && found->nodesetval && i < found->nodesetval->nodeNr; ++i)
    if (Element* const node = found->nodesetval->nodeTab[i]; node->type == XML_ELEMENT_NODE) elements.push_back(node);
  return elements;
}

/// A collection in time has one step for each of its grids; all others have one step.
void XdmfDocument::add_steps(Element& grid, Steps& steps, int depth) const {
  if (depth > deepest_grid) fail(path_, "its grids are in others more than sixteen deep; write it again");
  const std::string type = lower_case(xml_attribute(grid, {"GridType"})),
                    collection = lower_case(xml_attribute(grid, {"CollectionType"}));
  if (type != "collection" && type != "tree") {
    steps.push_back({&grid});
    return;
  }
  for (Element* const inner : children(grid, {"Grid"})) {
    Steps of_inner;
    add_steps(*inner, of_inner, depth + 1);
    if (of_inner.empty()) continue;
    if (type == "collection" && collection == "temporal")
      steps.push_back(of_inner.front());
    else
      add_beside(of_inner, steps);
    for (const std::vector<Element*>& step : steps)
      if (step.size() > max_grids) fail(path_, "its grids name more than a million of others; write it again");
  }
}

}  // namespace tensorray
