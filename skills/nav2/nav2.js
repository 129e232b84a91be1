// What the charts of this folder share: poses and paths of ROS and of robot.thrift, and what codes mean.

// {x, y, theta} of a geometry_msgs/PoseStamped, or of its text "stamp;frame;x;y;z;qx;qy;qz;qw".
function planar(pose) {
  if (typeof pose === 'string') {
    var part = pose.split(';');
    var is_pose = part.length === 9 && part.every(function (p, i) { return i === 1 || (p.trim() !== '' && !isNaN(p)); });
    if (!is_pose) throw new Error('"' + pose + '" is no pose: stamp;frame;x;y;z;qx;qy;qz;qw');
    part = part.map(Number);
    return {x: part[2], y: part[3], theta: 2 * Math.atan2(part[7], part[8])};
  }
  var q = pose.pose.orientation;
  return {x: pose.pose.position.x, y: pose.pose.position.y, theta: 2 * Math.atan2(q.z, q.w)};
}

// geometry_msgs/PoseStamped of such a pose, in either form; and one that says nothing.
function posed(pose) {
  if (typeof pose !== 'string') return pose;
  return stamped({stamp: stamp(0), frame_id: pose.split(';')[1].trim()}, planar(pose));
}
function unposed() { return stamped({stamp: stamp(0), frame_id: ''}, {x: 0, y: 0, theta: 0}); }

function stamp(time) {
  var sec = Math.floor(time);
  return {sec: sec, nanosec: Math.round((time - sec) * 1e9)};
}

// One object in two places could not be saved with the run.
function own(object) { return JSON.parse(JSON.stringify(object)); }

// The other way round.
function stamped(header, p) {
  return {header: own(header), pose: {position: {x: p.x, y: p.y, z: 0},
          orientation: {x: 0, y: 0, z: Math.sin(p.theta / 2), w: Math.cos(p.theta / 2)}}};
}

// nav_msgs/Path of a Path of robot.thrift.
function ros_path(path) {
  var header = {stamp: stamp(path.header.stamp), frame_id: path.header.frame_id};
  return {header: header, poses: path.poses.map(function (p) { return stamped(header, p); })};
}

function robot_path(poses) { return {header: {stamp: 0, frame_id: 'map'}, poses: poses.map(planar)}; }

function target(pose) { return {map_id: '', pose: planar(pose), description: ''}; }

// nav2_msgs' numbers of the simulated robot's errors; a code that is not of the server's is its first, `unknown`.
var codes = {NONE: 0, FAILED_TO_MAKE_PROGRESS: 105, NO_VALID_CONTROL: 106, START_OUTSIDE_MAP: 203, GOAL_OUTSIDE_MAP: 204,
             START_OCCUPIED: 205, GOAL_OCCUPIED: 206, PLAN_TIMEOUT: 207, NO_VALID_PATH: 208, COLLISION_AHEAD: 714,
             DOCK_NOT_IN_DB: 901, FAILED_TO_STAGE: 903, FAILED_TO_CONTROL: 905, FAILED_TO_CHARGE: 906,
             UNKNOWN: 9000, TF_ERROR: 9002, TIMEOUT: 9003};
function code_of(error, unknown) {
  var code = codes[error] || unknown;
  return code >= unknown && code < unknown + 10 ? code : unknown;
}

function dock_code(error) { return codes[error] > 900 && codes[error] < 999 ? codes[error] : 999; }

// Why a goal of an action ended, as far as the release's result says.
function ended_code(end, unknown) { return end.result && end.result.error_code || unknown; }
function ended_msg(end) { return end.result && end.result.error_msg || 'the goal ended ' + end.status; }

// Where the robot is on a path: the poses, lengths from its start, and how far along the nearest point is.
function place_on(path, here) {
  var poses = path.poses.map(planar), along = [0], best = Infinity, at = 0;
  for (var i = 1; i < poses.length; i++) {
    var a = poses[i - 1], b = poses[i], dx = b.x - a.x, dy = b.y - a.y, length = Math.sqrt(dx * dx + dy * dy);
    along.push(along[i - 1] + length);
    var t = length > 0 ? ((here.x - a.x) * dx + (here.y - a.y) * dy) / (length * length) : 0;
    t = Math.max(0, Math.min(1, t));
    var ex = a.x + t * dx - here.x, ey = a.y + t * dy - here.y, off = Math.sqrt(ex * ex + ey * ey);
    if (off < best) { best = off; at = along[i - 1] + t * length; }
  }
  return {poses: poses, along: along, at: at};
}

// The poses from `from` to `to`, in metres along the path; its ends are on it.
function part_of(path, place, from, to) {
  var along = place.along, n = along.length, out = [];
  function between(i, s) {
    var a = place.poses[i - 1], b = place.poses[i], t = (s - along[i - 1]) / (along[i] - along[i - 1]);
    return stamped(path.header, {x: a.x + t * (b.x - a.x), y: a.y + t * (b.y - a.y), theta: a.theta});
  }
  from = Math.max(0, from);
  to = Math.min(along[n - 1], to);
  for (var i = 0; i < n; i++) {
    if (i > 0 && along[i - 1] < from && from < along[i]) out.push(between(i, from));
    if (along[i] >= from && along[i] <= to) out.push(own(path.poses[i]));
    if (i > 0 && along[i - 1] < to && to < along[i]) out.push(between(i, to));
  }
  return {header: own(path.header), poses: out};
}

// A path whose corners are rounded: points not farther apart than 0.2 m, each drawn to the middle of its neighbours and back to
// where it was. Its ends stay, and each pose looks to the next one.
function smooth(path) {
  var poses = path.poses.map(planar), was = [poses[0]];
  for (var i = 1; i < poses.length; i++) {
    var a = poses[i - 1], b = poses[i], dx = b.x - a.x, dy = b.y - a.y;
    var parts = Math.max(1, Math.ceil(Math.sqrt(dx * dx + dy * dy) / 0.2));
    for (var k = 1; k <= parts; k++) was.push({x: a.x + dx * k / parts, y: a.y + dy * k / parts, theta: b.theta});
  }
  var is = was.map(function (p) { return {x: p.x, y: p.y, theta: p.theta}; });
  for (var round = 0; round < 40; round++) {
    for (var j = 1; j < is.length - 1; j++) {
      is[j].x += 0.2 * (was[j].x - is[j].x) + 0.3 * (is[j - 1].x + is[j + 1].x - 2 * is[j].x);
      is[j].y += 0.2 * (was[j].y - is[j].y) + 0.3 * (is[j - 1].y + is[j + 1].y - 2 * is[j].y);
    }
  }
  for (var n = 0; n < is.length - 1; n++) is[n].theta = Math.atan2(is[n + 1].y - is[n].y, is[n + 1].x - is[n].x);
  return {header: own(path.header), poses: is.map(function (p) { return stamped(path.header, p); })};
}
