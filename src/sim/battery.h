#pragma once

#include "sentree/base/time.h"
#include "sentree/sim/geometry.h"

namespace sentree::sim {

/// Charge is a ratio from 0 to 1; rates are ratios per second or per metre.
struct BatterySpec {
  double initial_charge = 1.0;
  double drain_per_s = 0.0005;  ///< Standing.
  double drain_per_m = 0.007;   ///< Added by motion.
  double charge_per_s = 0.01;
  double capacity_Ah = 0.5;  ///< Small, as the rates above want it: then 0.9 A standing and 7 A at 0.5 m/s.
  double voltage_empty_V = 22.0;
  double voltage_full_V = 29.4;
  double ambient_C = 22.0;
  double heating_K_per_A = 0.4;  ///< Rise above ambient in the long run.
  Duration thermal_time = std::chrono::seconds(600);
  double low = 0.15;  ///< Warnings at and below (YARP's fakeBattery).
  double critical = 0.05;

  friend bool operator==(const BatterySpec&, const BatterySpec&) = default;
};

enum class PowerSupplyStatus { kUnknown = 0, kCharging = 1, kDischarging = 2, kNotCharging = 3, kFull = 4 };
enum class BatteryWarning { kNone = 0, kLow = 1, kCritical = 2 };

struct Battery {
  double charge = 1.0;
  double current_A = 0.0;  ///< < 0 while discharging (ROS sign).
  double temperature_C = 22.0;
  bool plugged = false;  ///< Somebody connected the robot; ends when it leaves the station.
  bool full = false;     ///< Charged to the end at this station; stays so until the robot leaves it.

  friend bool operator==(const Battery&, const Battery&) = default;
};

[[nodiscard]] Battery initial_battery(const BatterySpec& spec);

/// Advances by `dt` in which the robot moved `moved_m` and stood within a station's tolerance or not.
///
/// Plugged in at the station it charges until full, and then stays full, neither charging nor draining, until
/// the robot leaves the station; leaving pulls the plug.
void step_battery(const BatterySpec& spec, Battery& battery, Duration dt, double moved_m, bool at_station);

[[nodiscard]] bool is_charging(const Battery& battery);
[[nodiscard]] PowerSupplyStatus status(const Battery& battery);
[[nodiscard]] BatteryWarning warning(const BatterySpec& spec, const Battery& battery);
[[nodiscard]] double voltage_V(const BatterySpec& spec, const Battery& battery);

}  // namespace sentree::sim
