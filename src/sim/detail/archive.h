#pragma once

#include "sentree/base/archive.h"
#include "sentree/sim/state.h"

namespace sentree::sim {

// The members of each type that a state is made of, once, for hashing, saving and restoring alike:
// `visit_members(object, visit)` calls `visit(name, member)` in a fixed order.
using archive::MaybeConst;

template <class S, class V>
requires MaybeConst<S, Vec2>
void visit_members(S& s, V&& visit) {
  visit("x", s.x);
  visit("y", s.y);
}
template <class S, class V>
requires MaybeConst<S, Pose2>
void visit_members(S& s, V&& visit) {
  visit("x", s.x);
  visit("y", s.y);
  visit("theta", s.theta);
}
template <class S, class V>
requires MaybeConst<S, Twist2>
void visit_members(S& s, V&& visit) {
  visit("vx", s.vx);
  visit("omega", s.omega);
}
template <class S, class V>
requires MaybeConst<S, GroundTruth>
void visit_members(S& s, V&& visit) {
  visit("pose", s.pose);
  visit("twist", s.twist);
  visit("collisions", s.collisions);
}
template <class S, class V>
requires MaybeConst<S, Battery>
void visit_members(S& s, V&& visit) {
  visit("charge", s.charge);
  visit("current", s.current_A);
  visit("temperature", s.temperature_C);
  visit("plugged", s.plugged);
  visit("full", s.full);
}
template <class S, class V>
requires MaybeConst<S, VelocityCommand>
void visit_members(S& s, V&& visit) {
  visit("twist", s.twist);
  visit("until", s.until);
}
template <class S, class V>
requires MaybeConst<S, Scan>
void visit_members(S& s, V&& visit) {
  visit("stamp", s.stamp);
  visit("ranges", s.ranges);
}
template <class S, class V>
requires MaybeConst<S, Particle>
void visit_members(S& s, V&& visit) {
  visit("pose", s.pose);
  visit("weight", s.weight);
}
template <class S, class V>
requires MaybeConst<S, PoseEstimate>
void visit_members(S& s, V&& visit) {
  visit("pose", s.pose);
  visit("covariance", s.covariance);
}
template <class S, class V>
requires MaybeConst<S, Localization>
void visit_members(S& s, V&& visit) {
  visit("status", s.status);
  visit("estimate", s.estimate);
  visit("map_to_odom", s.map_to_odom);
  visit("updated_at", s.updated_at);
  visit("particles", s.particles);
  visit("likelihood_slow", s.likelihood_slow);
  visit("likelihood_fast", s.likelihood_fast);
  visit("running", s.running);
  visit("rng", s.rng);
}
template <class S, class V>
requires MaybeConst<S, Goal>
void visit_members(S& s, V&& visit) {
  visit("id", s.id);
  visit("kind", s.kind);
  visit("amount", s.amount);
  visit("speed", s.speed_m_s);
  visit("name", s.name);
  visit("waypoints", s.waypoints);
}
template <class S, class V>
requires MaybeConst<S, Navigator>
void visit_members(S& s, V&& visit) {
  visit("status", s.status);
  visit("error", s.error);
  visit("error_message", s.error_message);
  visit("goal", s.goal);
  visit("goals", s.goals);
  visit("waypoint", s.waypoint);
  visit("started", s.started);
  visit("ended", s.ended);
  visit("path", s.path);
  visit("passed", s.passed);
  visit("distance_remaining", s.distance_remaining_m);
  visit("turning", s.turning);
  visit("paused_at", s.paused_at);
  visit("resume_at", s.resume_at);
  visit("deadline", s.deadline);
  visit("best_remaining", s.best_remaining_m);
  visit("progress_at", s.progress_at);
  visit("recovering_until", s.recovering_until);
  visit("recovery", s.recovery);
  visit("waiting_since", s.waiting_since);
  visit("last_pose", s.last_pose);
  visit("done", s.done);
  visit("retry_at", s.retry_at);
  visit("recoveries", s.recoveries);
  visit("seen", s.seen);
}
template <class S, class V>
requires MaybeConst<S, Shape>
void visit_members(S& s, V&& visit) {
  visit("kind", s.kind);
  visit("pose", s.pose);
  visit("radius", s.radius_m);
  visit("length", s.length_m);
  visit("width", s.width_m);
}
template <class S, class V>
requires MaybeConst<S, Obstacle>
void visit_members(S& s, V&& visit) {
  visit("id", s.id);
  visit("shape", s.shape);
  visit("on_map", s.on_map);
}
template <class S, class V>
requires MaybeConst<S, Door>
void visit_members(S& s, V&& visit) {
  visit("id", s.id);
  visit("a", s.a);
  visit("b", s.b);
  visit("thickness", s.thickness_m);
  visit("open", s.open);
  visit("on_map", s.on_map);
}
template <class S, class V>
requires MaybeConst<S, NamedLocation>
void visit_members(S& s, V&& visit) {
  visit("name", s.name);
  visit("pose", s.pose);
  visit("description", s.description);
}
template <class S, class V>
requires MaybeConst<S, NamedArea>
void visit_members(S& s, V&& visit) {
  visit("name", s.name);
  visit("points", s.points);
  visit("description", s.description);
}
template <class S, class V>
requires MaybeConst<S, NamedPath>
void visit_members(S& s, V&& visit) {
  visit("name", s.name);
  visit("poses", s.poses);
}
template <class S, class V>
requires MaybeConst<S, NamedObject>
void visit_members(S& s, V&& visit) {
  visit("name", s.name);
  visit("pose", s.pose);
  visit("description", s.description);
}
template <class S, class V>
requires MaybeConst<S, TimeControl>
void visit_members(S& s, V&& visit) {
  visit("factor", s.factor);
  visit("paused", s.paused);
  visit("run_anchor", s.run_anchor);
  visit("sim_anchor", s.sim_anchor);
}
template <class S, class V>
requires MaybeConst<S, RobotState>
void visit_members(S& s, V&& visit) {
  visit("truth", s.truth);
  visit("battery", s.battery);
  visit("station", s.station);
  visit("arrived", s.arrived);
  visit("odometry", s.odometry);
  visit("odometry_twist", s.odometry_twist);
  visit("command", s.command);
  visit("drive", s.drive);
  visit("scan", s.scan);
  visit("scan_odometry", s.scan_odometry);
  visit("localization", s.localization);
  visit("navigator", s.navigator);
  visit("odometry_rng", s.odometry_rng);
  visit("laser_rng", s.laser_rng);
}
template <class S, class V>
requires MaybeConst<S, State>
void visit_members(S& s, V&& visit) {
  visit("time", s.time);
  visit("seed", s.seed);
  visit("clock", s.clock);
  visit("robots", s.robots);
  visit("obstacles", s.obstacles);
  visit("doors", s.doors);
  visit("locations", s.locations);
  visit("areas", s.areas);
  visit("paths", s.paths);
  visit("objects", s.objects);
}

}  // namespace sentree::sim
