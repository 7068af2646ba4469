// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace cuboid_mapping::lanes {

/// Two vectors of one register each, as one vector: gcc compares and selects lane by lane where a vector is
/// wider than a register. A number counts as a vector of equal lanes.
template <typename HalfT>
struct LanePair {
  using Half = HalfT;
  using Lane = decltype(HalfT{}[0] + HalfT{}[0]);

  HalfT low{};
  HalfT high{};

  LanePair() = default;
  LanePair(const HalfT& low_half, const HalfT& high_half) : low(low_half), high(high_half) {}
  LanePair(Lane lane) : low(HalfT{} + lane), high(low) {}

#define CUBOID_MAPPING_LANE_OPERATOR(op)                          \
  friend auto operator op(const LanePair& a, const LanePair& b) { \
    return pairOf(a.low op b.low, a.high op b.high);              \
  }
  CUBOID_MAPPING_LANE_OPERATOR(+)
  CUBOID_MAPPING_LANE_OPERATOR(-)
  CUBOID_MAPPING_LANE_OPERATOR(*)
  CUBOID_MAPPING_LANE_OPERATOR(&)
  CUBOID_MAPPING_LANE_OPERATOR(|)
  CUBOID_MAPPING_LANE_OPERATOR(^)
  CUBOID_MAPPING_LANE_OPERATOR(<)
  CUBOID_MAPPING_LANE_OPERATOR(>)
  CUBOID_MAPPING_LANE_OPERATOR(<=)
  CUBOID_MAPPING_LANE_OPERATOR(==)
  CUBOID_MAPPING_LANE_OPERATOR(!=)
#undef CUBOID_MAPPING_LANE_OPERATOR

  friend LanePair operator<<(const LanePair& a, int bits) {
    return {a.low << bits, a.high << bits};
  }
  friend LanePair operator>>(const LanePair& a, int bits) {
    return {a.low >> bits, a.high >> bits};
  }
  LanePair operator~() const { return {~low, ~high}; }
  LanePair& operator&=(const LanePair& other) { return *this = *this & other; }
  LanePair& operator|=(const LanePair& other) { return *this = *this | other; }

  template <typename FlagsT>
  static LanePair<FlagsT> pairOf(const FlagsT& low_half, const FlagsT& high_half) {
    return {low_half, high_half};
  }
};

/// As those of lanes.h.
///@{
template <typename FlagsT, typename HalfT>
LanePair<HalfT> select(const LanePair<FlagsT>& flags, const LanePair<HalfT>& a,
                       const LanePair<HalfT>& b) {
  return {flags.low ? a.low : b.low, flags.high ? a.high : b.high};
}
template <typename ToT, typename HalfT>
ToT as(const LanePair<HalfT>& from) {
  return {reinterpret_cast<typename ToT::Half>(from.low),
          reinterpret_cast<typename ToT::Half>(from.high)};
}
template <typename ToT, typename HalfT>
ToT convert(const LanePair<HalfT>& from) {
  return {__builtin_convertvector(from.low, typename ToT::Half),
          __builtin_convertvector(from.high, typename ToT::Half)};
}
///@}

}  // namespace cuboid_mapping::lanes
