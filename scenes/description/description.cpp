#include "scenes/description/description.h"

namespace tensorray {

void Method::check(SceneDescription&, const Json&, const SceneSource&, bool) const {}

const Method& IntegratorDescription::method() const {
  for (const auto& method : methods)
    if (method->name() == type.value) return *method;
  throw std::logic_error("no method is chosen");
}

}  // namespace tensorray
