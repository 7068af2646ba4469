// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Internal to parameters.h: kinds of parameters, which read and write their values.

#include "cuboid_mapping/ros/parameters/parameters.h"

#include <xmlrpcpp/XmlRpcValue.h>

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace cuboid_mapping_ros {

/// Place of a parameter's value: a path of members from NodeParameters, SourceParameters or a struct of
/// FeatureValues, or another place.
template <typename T>
class Field {
 public:
  template <typename MemberT, typename OwnerT, typename... RestT>
  Field(MemberT OwnerT::*first, RestT... rest)
      : at_([=](NodeParameters& p) -> T& {
          if constexpr (std::is_same_v<OwnerT, SourceParameters>) {
            return ((p.source.*first).*....*rest);
          } else if constexpr (std::is_base_of_v<StepParameters, OwnerT>) {
            return ((p.source.of<OwnerT>().*first).*....*rest);
          } else if constexpr (std::is_same_v<OwnerT, NodeParameters>) {
            return ((p.*first).*....*rest);
          } else {
            return ((p.of<OwnerT>().*first).*....*rest);
          }
        }),
        is_of_source_(std::is_same_v<OwnerT, SourceParameters> ||
                      std::is_base_of_v<StepParameters, OwnerT>) {}
  Field(std::function<T&(NodeParameters&)> at, bool is_of_source)
      : at_(std::move(at)), is_of_source_(is_of_source) {}

  [[nodiscard]] T& operator()(NodeParameters& p) const { return at_(p); }
  [[nodiscard]] bool isOfSource() const { return is_of_source_; }

 private:
  std::function<T&(NodeParameters&)> at_;
  bool is_of_source_;
};

/// Kind of a parameter.
struct ParameterKind {
  std::string allowed;        ///< Allowed values in words, such as "a number from 0.501 to 0.999".
  bool is_of_source = false;  ///< Whether a source of a list may have its own value.
  /// Sets a value. @return Reason of refusal and the cure; empty if it is set.
  std::function<std::string(NodeParameters&, const XmlRpc::XmlRpcValue&)> set = nullptr;
  /// The value in the form of the parameter server; not set for a list that is not given.
  std::function<XmlRpc::XmlRpcValue(NodeParameters)> get = nullptr;
  double min = -std::numeric_limits<double>::infinity();  ///< Limit of a number.
  double max = std::numeric_limits<double>::infinity();   ///< Limit of a number.
  bool is_name = false;                                   ///< Whether it is one of several names.
  bool is_frame = false;                                  ///< Whether it is a tf2 frame.
  bool is_adjustable = false;  ///< Whether it can be changed while the node runs.
};

/// A number in a closed interval, never NaN or infinite. @param minus_one  Meaning of -1, if it is allowed
/// in addition to the interval.
[[nodiscard]] ParameterKind number(const Field<double>& field,
                                   double min = -std::numeric_limits<double>::infinity(),
                                   double max = std::numeric_limits<double>::infinity(),
                                   std::optional<double> minus_one = std::nullopt);

/// A whole number in a closed interval.
[[nodiscard]] ParameterKind integer(const Field<int>& field, int min, int max);

[[nodiscard]] ParameterKind boolean(const Field<bool>& field);

/// A text of some form. @param set  Returns false to refuse.
[[nodiscard]] ParameterKind parsedText(
    const std::string& allowed, bool is_of_source,
    const std::function<bool(NodeParameters&, const std::string&)>& set,
    const std::function<std::string(const NodeParameters&)>& get);

/// A text that is kept as given. @param is_good  Null: any text is.
[[nodiscard]] ParameterKind text(const std::string& allowed, const Field<std::string>& field,
                                 bool (*is_good)(const std::string& text) = nullptr);

/// A tf2 frame, without a slash at its start.
[[nodiscard]] ParameterKind frame(const Field<std::string>& field, bool may_be_empty);

/// A path of the file system, or empty.
[[nodiscard]] ParameterKind file(const Field<std::string>& field);

/// A parameter that can be changed while the node runs.
[[nodiscard]] inline ParameterKind adjustable(ParameterKind kind) {
  kind.is_adjustable = true;
  return kind;
}

/// Joins words as "a or b", "a, b or c".
[[nodiscard]] std::string joinAlternatives(const std::vector<std::string>& words);

/// The content of a text, or of a number; nothing for other values.
///@{
[[nodiscard]] std::optional<std::string> textOf(XmlRpc::XmlRpcValue value);
[[nodiscard]] std::optional<double> numberOf(XmlRpc::XmlRpcValue value);
///@}

/// One of several names, each of which stands for a value.
template <typename T>
[[nodiscard]] ParameterKind choice(const Field<T>& field,
                                   const std::vector<std::pair<std::string, T>>& values) {
  ParameterKind kind;
  kind.is_of_source = field.isOfSource();
  kind.is_name = true;
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const auto& [name, value] : values) names.push_back(name);
  kind.allowed = joinAlternatives(names);
  kind.set = [field, values](NodeParameters& p, const XmlRpc::XmlRpcValue& given) -> std::string {
    const auto text = textOf(given);
    for (const auto& [name, value] : values) {
      if (text != name) continue;
      field(p) = value;
      return {};
    }
    return text == "brick" ? "it was replaced by class: write class" : "choose one of the names";
  };
  kind.get = [field, values](NodeParameters p) {
    for (const auto& [name, value] : values) {
      if (field(p) == value) return XmlRpc::XmlRpcValue(name);
    }
    return XmlRpc::XmlRpcValue();
  };
  return kind;
}

}  // namespace cuboid_mapping_ros
