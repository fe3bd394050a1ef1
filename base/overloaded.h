#pragma once
/// A function for each kind of a variant, as std::visit takes them: the compiler finds the kinds that are forgotten.

namespace tensorray {

template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

}  // namespace tensorray
