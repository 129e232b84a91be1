#include "sentree/sim/battery.h"

#include <algorithm>
#include <cmath>

namespace sentree::sim {

namespace {
constexpr double kSecondsPerHour = 3600.0;

// Of the way to the temperature at which it stays. Steps are mostly of one length.
double settled_share(double times) {
  thread_local double last_times = 0.0;
  thread_local double last_share = 0.0;
  if (times != last_times) {
    last_times = times;
    last_share = 1.0 - std::exp(-times);
  }
  return last_share;
}
}  // namespace

Battery initial_battery(const BatterySpec& spec) {
  return {.charge = spec.initial_charge, .current_A = 0.0, .temperature_C = spec.ambient_C};
}

void step_battery(const BatterySpec& spec, Battery& battery, Duration dt, double moved_m, bool at_station) {
  const double s = seconds(dt);
  if (!at_station) {
    battery.plugged = false;
    battery.full = false;
  }
  const double before = battery.charge;
  if (is_charging(battery)) {
    battery.charge = std::min(1.0, battery.charge + spec.charge_per_s * s);
    battery.full = battery.charge >= 1.0;
  } else if (!battery.full) {
    battery.charge = std::max(0.0, battery.charge - spec.drain_per_s * s - spec.drain_per_m * moved_m);
  }
  battery.current_A = s > 0.0 ? (battery.charge - before) * spec.capacity_Ah * kSecondsPerHour / s : 0.0;
  const double settled_C = spec.ambient_C + spec.heating_K_per_A * std::abs(battery.current_A);
  battery.temperature_C += (settled_C - battery.temperature_C) * settled_share(s / seconds(spec.thermal_time));
}

bool is_charging(const Battery& battery) { return battery.plugged && !battery.full; }

PowerSupplyStatus status(const Battery& battery) {
  if (battery.full) return PowerSupplyStatus::kFull;
  return battery.plugged ? PowerSupplyStatus::kCharging : PowerSupplyStatus::kDischarging;
}

BatteryWarning warning(const BatterySpec& spec, const Battery& battery) {
  if (battery.charge <= spec.critical) return BatteryWarning::kCritical;
  return battery.charge <= spec.low ? BatteryWarning::kLow : BatteryWarning::kNone;
}

double voltage_V(const BatterySpec& spec, const Battery& battery) {
  return spec.voltage_empty_V + (spec.voltage_full_V - spec.voltage_empty_V) * battery.charge;
}

}  // namespace sentree::sim
