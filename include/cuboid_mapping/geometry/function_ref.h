// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <type_traits>
#include <utility>

namespace cuboid_mapping {

template <typename SignatureT>
class FunctionRef;

/// Reference to a function, for a parameter that is called before the call returns. Owns nothing.
template <typename ResultT, typename... ArgumentsT>
class FunctionRef<ResultT(ArgumentsT...)> {
 public:
  /// @param function  Must outlive this object.
  template <typename FunctionT,
            typename = std::enable_if_t<!std::is_same_v<std::decay_t<FunctionT>, FunctionRef>>>
  FunctionRef(FunctionT&& function)  // NOLINT(google-explicit-constructor): as a lambda is written
      : object_(const_cast<void*>(static_cast<const void*>(&function))),
        call_([](void* object, ArgumentsT... arguments) -> ResultT {
          return (*static_cast<std::remove_reference_t<FunctionT>*>(object))(
              std::forward<ArgumentsT>(arguments)...);
        }) {}

  /// Calls the function.
  ResultT operator()(ArgumentsT... arguments) const {
    return call_(object_, std::forward<ArgumentsT>(arguments)...);
  }

 private:
  void* object_;
  ResultT (*call_)(void*, ArgumentsT...);
};

}  // namespace cuboid_mapping
