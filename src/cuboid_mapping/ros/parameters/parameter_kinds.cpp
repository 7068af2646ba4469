// SPDX-License-Identifier: BSD-3-Clause
#include "cuboid_mapping/ros/parameters/parameter_kinds.h"

#include "cuboid_mapping/ros/middleware/tf_lookup.h"
#include "cuboid_mapping/ros/parameters/parameter_table.h"

#include <cmath>

namespace cuboid_mapping_ros {
namespace {

using P = NodeParameters;
using XmlRpc::XmlRpcValue;

std::string numberInWords(double min, double max, bool allows_minus_one) {
  const std::string start = allows_minus_one ? "-1, or a number" : "a number";
  if (std::isfinite(max)) return start + " from " + formatNumber(min) + " to " + formatNumber(max);
  return std::isfinite(min) ? start + " of at least " + formatNumber(min) : start;
}

template <typename T>
auto getterOf(const Field<T>& field) {
  return [field](P p) { return XmlRpcValue(field(p)); };
}

}  // namespace

// XmlRpcValue in Noetic has no const conversions: values are copied.

ParameterKind number(const Field<double>& field, double min, double max,
                     std::optional<double> minus_one) {
  ParameterKind kind{numberInWords(min, max, minus_one.has_value()), field.isOfSource()};
  kind.set = [=](P& p, const XmlRpcValue& value) -> std::string {
    const auto read = numberOf(value);
    if (!read) return "write it without quotes, an exponent as in 1.0e+9";
    const double given = *read;
    const bool is_minus_one = minus_one && given == -1.0;
    if (!is_minus_one && !(std::isfinite(given) && given >= min && given <= max)) {
      return "correct it";
    }
    field(p) = is_minus_one ? *minus_one : given;
    return {};
  };
  kind.get = [=](P p) { return XmlRpcValue(minus_one && std::isinf(field(p)) ? -1.0 : field(p)); };
  kind.min = minus_one ? -1.0 : min;
  kind.max = max;
  return kind;
}

ParameterKind integer(const Field<int>& field, int min, int max) {
  const auto set = [=](P& p, XmlRpcValue value) -> std::string {
    if (value.getType() != XmlRpcValue::TypeInt) {
      return "write it without quotes and without a decimal point";
    }
    const int given = static_cast<int&>(value);
    if (given < min || given > max) return "correct it";
    field(p) = given;
    return {};
  };
  return {"a whole number from " + std::to_string(min) + " to " + std::to_string(max),
          field.isOfSource(), set, getterOf(field)};
}

ParameterKind boolean(const Field<bool>& field) {
  const auto set = [field](P& p, XmlRpcValue value) -> std::string {
    if (value.getType() != XmlRpcValue::TypeBoolean) return "write true or false, without quotes";
    field(p) = static_cast<bool&>(value);
    return {};
  };
  return {"true or false", field.isOfSource(), set, getterOf(field)};
}

ParameterKind parsedText(const std::string& allowed, bool is_of_source,
                         const std::function<bool(P&, const std::string&)>& set,
                         const std::function<std::string(const P&)>& get) {
  const auto set_text = [set](P& p, const XmlRpcValue& value) -> std::string {
    const auto given = textOf(value);
    if (!given) return "write it in quotes";
    return set(p, *given) ? "" : "correct it";
  };
  return {allowed, is_of_source, set_text, [get](const P& p) { return XmlRpcValue(get(p)); }};
}

ParameterKind text(const std::string& allowed, const Field<std::string>& field,
                   bool (*is_good)(const std::string& text)) {
  return parsedText(
      allowed, field.isOfSource(),
      [=](P& p, const std::string& given) {
        if (is_good != nullptr && !is_good(given)) return false;
        field(p) = given;
        return true;
      },
      [field](P p) { return field(p); });
}

ParameterKind frame(const Field<std::string>& field, bool may_be_empty) {
  ParameterKind kind = parsedText(
      may_be_empty ? "a tf2 frame, or empty" : "a tf2 frame", field.isOfSource(),
      [=](P& p, const std::string& given) {
        const std::string frame_id = withoutSlash(given);
        if (frame_id.empty() && !may_be_empty) return false;
        field(p) = frame_id;
        return true;
      },
      [field](P p) { return field(p); });
  kind.is_frame = true;
  return kind;
}

ParameterKind file(const Field<std::string>& field) { return text("a path, or empty", field); }

std::string joinAlternatives(const std::vector<std::string>& words) {
  std::string joined;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) joined += i + 1 == words.size() ? " or " : ", ";
    joined += words[i];
  }
  return joined;
}

std::optional<std::string> textOf(XmlRpcValue value) {
  if (value.getType() != XmlRpcValue::TypeString) return std::nullopt;
  return static_cast<std::string&>(value);
}

std::optional<double> numberOf(XmlRpcValue value) {
  if (value.getType() == XmlRpcValue::TypeInt) return static_cast<int&>(value);
  if (value.getType() == XmlRpcValue::TypeDouble) return static_cast<double&>(value);
  return std::nullopt;
}

}  // namespace cuboid_mapping_ros
