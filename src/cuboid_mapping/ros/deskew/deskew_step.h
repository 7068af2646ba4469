// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuboid_mapping/ros/deskew/sweep.h"
#include "cuboid_mapping/ros/mapping/sensor_step.h"

#include <optional>
#include <string>
#include <vector>

namespace cuboid_mapping_ros {

struct DeskewParameters : StepParameters {
  bool is_on = false;        ///< Each point has the pose of its own time; else that of the stamp.
  double time_unit_s = 0.0;  ///< Unit of the times of points; 0: see readPointTimes().
};

/// Puts each point where the sensor was at the time of the point.
class DeskewStep : public SensorStep {
 public:
  DeskewStep(const NodeParameters& parameters, const SourceParameters& source);

  [[nodiscard]] static std::vector<ParameterDeclaration> declare();
  [[nodiscard]] static std::vector<ParameterError> check(const LoadedParameters& loaded);
  [[nodiscard]] static bool isOn(const NodeParameters& parameters, const SourceParameters& source);

  [[nodiscard]] Slices findSlices(const SensorMessage& message) const override;
  [[nodiscard]] std::optional<CloudError> refuse(const SensorMessage& message,
                                                 const Slices& slices) const override;
  [[nodiscard]] std::string findWarning(const SensorMessage& message,
                                        const Slices& slices) const override;
  void setOptions(CloudOptions& options) const override { options.wants_numbers = true; }
  [[nodiscard]] std::vector<CloudPoints> divide(const SensorMessage& message,
                                                const CloudPoints& points,
                                                const Slices& slices) const override;

 private:
  [[nodiscard]] std::optional<PointTimes> readTimes(const SensorMessage& message) const;

  bool maps_no_returns_;  ///< Beams without return have times, too.
  double unit_s_;
};

}  // namespace cuboid_mapping_ros
