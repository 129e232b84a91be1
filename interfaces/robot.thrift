// Services of the simulated robot. SI units: m, rad, s, V, A, degC; charge as a ratio 0..1.
// Frames follow REP 103/105: "map" -> "odom" -> "base_link" -> "laser". Poses are (x, y, theta), theta in (-pi, pi], CCW from +x.
// Names map 1:1 to YARP INavigation2D/ILocalization2D/IMap2D/IBattery/IRangefinder2D and to ROS 2 nav2_msgs, nav_msgs, sensor_msgs.
namespace cpp robot

enum ReturnCode { OK = 0, ERROR = 1, NOT_IMPLEMENTED = 2, NOT_READY = 3, OUT_OF_BOUNDS = 4, UNKNOWN_NAME = 5 }   // ~ yarp ReturnValue
struct Header   { 1: double stamp, 2: string frame_id = "map" }                 // stamp: simulated s since start
struct Pose2D   { 1: double x (unit = "m"), 2: double y (unit = "m"), 3: double theta (unit = "rad") }
struct Twist2D  { 1: double vx (unit = "m/s"), 2: double vy = 0 (unit = "m/s"), 3: double omega (unit = "rad/s") }              // m/s, m/s, rad/s in base_link
struct PoseStamped { 1: Header header, 2: Pose2D pose }
struct PoseWithCovariance { 1: Header header, 2: Pose2D pose, 3: list<double> covariance }  // 3x3 row-major (x, y, theta)
struct Odometry { 1: Header header, 2: Pose2D pose, 3: Twist2D twist, 4: string child_frame_id = "base_link" }
struct Point2D  { 1: double x, 2: double y }
struct Location { 1: string map_id, 2: Pose2D pose, 3: string description = "" }             // yarp Map2DLocation (theta in rad here)
struct Area     { 1: string map_id, 2: list<Point2D> points, 3: string description = "" }
struct Path     { 1: Header header, 2: list<Pose2D> poses }
struct PoseReply { 1: ReturnCode code, 2: Pose2D pose }
struct LocationReply { 1: ReturnCode code, 2: Location location }
struct AreaReply { 1: ReturnCode code, 2: Area area }
struct PathReply { 1: ReturnCode code, 2: Path path }

struct MapInfo { 1: string map_id, 2: double resolution, 3: i32 width, 4: i32 height, 5: Pose2D origin }
struct OccupancyGrid { 1: Header header, 2: MapInfo info, 3: binary data }      // int8 row-major from lower left: -1 unknown, 0..100
struct OccupancyGridReply { 1: ReturnCode code, 2: OccupancyGrid grid }

// --- navigation (YARP INavigation2D*, Nav2 NavigateToPose) ---
enum NavigationStatus { IDLE = 0, PREPARING_BEFORE_MOVE = 1, MOVING = 2, WAITING_OBSTACLE = 3, GOAL_REACHED = 4,
                        ABORTED = 5, FAILING = 6, PAUSED = 7, THINKING = 8, ERROR = 9 }      // the ten of YARP
enum NavigationError  { NONE = 0, GOAL_REJECTED = 1, SEND_GOAL_FAILURE = 2,
                        PLAN_UNKNOWN = 200, START_OUTSIDE_MAP = 203, GOAL_OUTSIDE_MAP = 204, START_OCCUPIED = 205, GOAL_OCCUPIED = 206,
                        PLAN_TIMEOUT = 207, NO_VALID_PATH = 208, FAILED_TO_MAKE_PROGRESS = 105, NO_VALID_CONTROL = 106,
                        COLLISION_AHEAD = 714, DOCK_NOT_IN_DB = 901, FAILED_TO_STAGE = 903, FAILED_TO_CONTROL = 905, FAILED_TO_CHARGE = 906,
                        UNKNOWN = 9000, TF_ERROR = 9002, TIMEOUT = 9003 }                    // Nav2 numbers
struct NavigationState { 1: NavigationStatus status, 2: NavigationError error_code = NavigationError.NONE, 3: string error_msg = "",
                         4: i64 goal_id, 5: string target_name = "", 6: Location target,
                         7: double navigation_time (unit = "s"), 8: double estimated_time_remaining (unit = "s"),
                         9: double distance_remaining (unit = "m"), 10: i32 number_of_recoveries }
struct GoalReply { 1: ReturnCode code, 2: i64 goal_id, 3: NavigationError error_code = NavigationError.NONE }
struct PlanReply { 1: ReturnCode code, 2: NavigationError error_code = NavigationError.NONE, 3: string error_msg = "", 4: Path path, 5: double length }
enum NavigationMapType { GLOBAL = 0, LOCAL = 1 }                 // yarp NavigationMapTypeEnum
service Navigation {
  GoalReply  gotoTargetByLocationName(1: string name)          // location, or an area (its centre)
  GoalReply  gotoTargetByAbsoluteLocation(1: Location target)
  GoalReply  gotoTargetByRelativeLocation(1: Pose2D delta)     // base_link
  GoalReply  followPath(1: Path path)
  GoalReply  spin(1: double angle)                             // on the spot, CCW
  GoalReply  driveStraight(1: double distance)                 // < 0: back; ends with COLLISION_AHEAD where something is in the way
  GoalReply  driveStraightAt(1: double distance, 2: double speed (unit = "m/s", min = "0"))   // the same, no faster; 0: at the robot's own speed
  GoalReply  dockRobot(1: string station)                      // reached once the battery charges
  GoalReply  undockRobot()                                     // straight back out of the station; NOT_READY away from one
  NavigationState  getNavigationState() (idempotent = "true")
  NavigationStatus getNavigationStatus() (idempotent = "true")
  string     getNameOfCurrentTarget() (idempotent = "true")  // "" when none
  LocationReply getAbsoluteLocationOfCurrentTarget() (idempotent = "true")  // NOT_READY when none
  PoseReply  getRelativeLocationOfCurrentTarget() (idempotent = "true")  // base_link
  LocationReply getCurrentNavigationWaypoint() (idempotent = "true")  // the corner of the path that is next; NOT_READY off a path
  ReturnCode stopNavigation(1: i64 goal_id) (idempotent = "true")  // that goal only (no effect on any other) -> IDLE; 0: whichever is current
  ReturnCode suspendNavigation(1: double time_s)               // < 0: until resumed
  ReturnCode resumeNavigation()
  ReturnCode recomputeCurrentNavigationPath()
  Path       getAllNavigationWaypoints() (idempotent = "true")
  PlanReply  computePathTo(1: Location target) (idempotent = "true")  // plans and drives nowhere
  PlanReply  computePathBetween(1: Pose2D start, 2: Location target) (idempotent = "true")
  bool       isPathValid(1: Path path) (idempotent = "true")  // false: the robot knows of something that stands on it; or it is empty
  OccupancyGridReply getCurrentNavigationMap(1: NavigationMapType type) (idempotent = "true")  // costs: 0 free .. 99 near, 100 closed; LOCAL: around the robot
  ReturnCode clearCurrentNavigationMap()                       // forgets what the laser saw beyond the map
  bool       checkInsideArea(1: string area_name) (idempotent = "true")
  bool       checkNearToLocation(1: string name, 2: double linear_tolerance (unit = "m", min = "0"),
                                      3: double angular_tolerance (unit = "rad", min = "0")) (idempotent = "true")
  bool       checkInsideGivenArea(1: Area area) (idempotent = "true")
  bool       checkNearToGivenLocation(1: Location location, 2: double linear_tolerance (unit = "m", min = "0"),
                                      3: double angular_tolerance (unit = "rad", min = "0")) (idempotent = "true")
  string     findCurrentArea() (idempotent = "true")  // the first stored area that holds the robot; "" when none
}

// --- localization (ILocalization2D, amcl_pose) ---
enum LocalizationStatus { NOT_YET_LOCALIZED = 0, LOCALIZED_OK = 1, ERROR = 2 }
service Localization {
  LocalizationStatus getLocalizationStatus() (idempotent = "true")
  PoseWithCovariance getCurrentPosition() (idempotent = "true")
  list<PoseStamped>  getEstimatedPoses() (idempotent = "true")  // particle cloud, may be decimated
  Odometry   getEstimatedOdometry() (idempotent = "true")
  ReturnCode setInitialPose(1: PoseWithCovariance pose)
  ReturnCode reinitializeGlobalLocalization()
  ReturnCode startLocalizationService()
  ReturnCode stopLocalizationService()                         // takes nothing in until started; status ERROR
}

// --- map (IMap2D, nav_msgs/OccupancyGrid) ---
struct MapObject { 1: string map_id, 2: double x, 3: double y, 4: double z = 0, 5: double roll = 0, 6: double pitch = 0, 7: double yaw = 0, 8: string description = "" }  // yarp Map2DObject
struct MapObjectReply { 1: ReturnCode code, 2: MapObject object }
service MapServer {
  OccupancyGridReply getMap(1: string map_id) (idempotent = "true")
  list<string>  getMapNames() (idempotent = "true")
  list<string>  getLocationsList() (idempotent = "true")
  LocationReply getLocation(1: string name) (idempotent = "true")
  ReturnCode    storeLocation(1: string name, 2: Location location)
  ReturnCode    deleteLocation(1: string name)
  ReturnCode    renameLocation(1: string name, 2: string new_name)
  ReturnCode    clearAllLocations()
  list<string>  getAreasList() (idempotent = "true")
  AreaReply     getArea(1: string name) (idempotent = "true")
  ReturnCode    storeArea(1: string name, 2: Area area)
  ReturnCode    deleteArea(1: string name)
  ReturnCode    renameArea(1: string name, 2: string new_name)
  ReturnCode    clearAllAreas()
  list<string>  getPathsList() (idempotent = "true")
  PathReply     getPath(1: string name) (idempotent = "true")
  ReturnCode    storePath(1: string name, 2: Path path)
  ReturnCode    deletePath(1: string name)
  ReturnCode    renamePath(1: string name, 2: string new_name)
  ReturnCode    clearAllPaths()
  list<string>  getObjectsList() (idempotent = "true")
  MapObjectReply getObject(1: string name) (idempotent = "true")
  ReturnCode    storeObject(1: string name, 2: MapObject object)
  ReturnCode    deleteObject(1: string name)
  ReturnCode    renameObject(1: string name, 2: string new_name)
  ReturnCode    clearAllObjects()
}

// --- battery (IBattery, sensor_msgs/BatteryState) ---
enum PowerSupplyStatus { UNKNOWN = 0, CHARGING = 1, DISCHARGING = 2, NOT_CHARGING = 3, FULL = 4 }
enum BatteryWarning    { NONE = 0, LOW = 1, CRITICAL = 2 }                       // YARP BATTERY_LOW/CRITICAL_WARNING
enum BatteryStatus     { OK_STANDBY = 0, OK_IN_CHARGE = 1, OK_IN_USE = 2, GENERAL_ERROR = 3, TIMEOUT = 4, LOW_WARNING = 5, CRITICAL_WARNING = 6 }  // YARP's
struct BatteryState { 1: Header header, 2: double voltage (unit = "V"), 3: double current (unit = "A"),     // current < 0 while discharging (ROS sign)
                      4: double percentage (unit = "ratio"),                                    // 0..1, as in sensor_msgs
                      5: double temperature (unit = "degC"), 6: PowerSupplyStatus power_supply_status, 7: BatteryWarning warning, 8: bool present = true }
service Battery {
  BatteryState getBatteryState() (idempotent = "true")
  double       getBatteryCharge() (unit = "%", idempotent = "true")  // 0..100 %, YARP name and unit
  bool         isCharging() (idempotent = "true")
  double       getBatteryVoltage() (idempotent = "true")  // V
  double       getBatteryCurrent() (idempotent = "true")  // A, < 0 while discharging (ROS sign; YARP's is the opposite)
  double       getBatteryTemperature() (idempotent = "true")  // degC
  BatteryStatus getBatteryStatus() (idempotent = "true")
  string       getBatteryInfo() (idempotent = "true")
}

// --- laser (IRangefinder2D, sensor_msgs/LaserScan) ---
struct LaserScan { 1: Header header, 2: double angle_min, 3: double angle_max, 4: double angle_increment, 5: double scan_time,
                   6: double range_min, 7: double range_max, 8: list<double> ranges }  // +inf: nothing within range_max
struct Interval { 1: double min, 2: double max }
enum DeviceStatus { OK_STANDBY = 0, OK_IN_USE = 1, GENERAL_ERROR = 2, TIMEOUT = 3 }
service Laser {
  LaserScan    getLaserMeasurement() (idempotent = "true")
  list<double> getRawData() (idempotent = "true")  // the ranges alone
  DeviceStatus getDeviceStatus() (idempotent = "true")
  Interval     getDistanceRange() (idempotent = "true")  // m
  Interval     getScanLimits() (idempotent = "true")  // rad, of the first and the last beam
  double       getHorizontalResolution() (idempotent = "true")  // rad between beams
  double       getScanRate() (idempotent = "true")  // Hz
  string       getDeviceInfo() (idempotent = "true")
}

// --- topics: what the simulator publishes, each at the rate that `publish:` of a service in sentree.yaml gives it ---
service Telemetry {
  oneway void battery(1: BatteryState state)                   // as Battery.getBatteryState
  oneway void position(1: PoseWithCovariance state)            // as Localization.getCurrentPosition
  oneway void odometry(1: Odometry state)
  oneway void navigation(1: NavigationState state)
  oneway void scan(1: LaserScan state)
}

// --- base ---
service Base {
  ReturnCode applyVelocityCommand(1: Twist2D cmd, 2: double timeout)   // stops after timeout (YARP default 0.1 s)
  Twist2D    getLastVelocityCommand() (idempotent = "true")
  Odometry   getOdometry() (idempotent = "true")
  ReturnCode resetOdometry()
}

// --- test control: never used by a skill ---
// The robot is the one whose Simulation service is called; obstacles, doors, and time are of the whole world.
service Simulation {
  ReturnCode setBatteryCharge(1: double percent (unit = "%"))  // the paper's experiment 1: force 10 %
  ReturnCode plugIn()                                          // a person connects the robot; NOT_READY away from a station
  ReturnCode unplug()
  ReturnCode setRobotPose(1: Pose2D pose)                      // teleport ground truth; localization by odometry is told, AMCL is not
  Pose2D     getGroundTruth() (idempotent = "true")
  i64        getCollisions() (idempotent = "true")  // motions that a wall or an obstacle stopped
  ReturnCode addObstacle(1: string id, 2: Point2D centre, 3: double radius)                           // a disc that only the laser sees
  ReturnCode addWall(1: string id, 2: Point2D a, 3: Point2D b, 4: double thickness, 5: bool on_map)   // on_map: the robots know it unseen
  ReturnCode moveObstacle(1: string id, 2: Point2D centre)
  ReturnCode removeObstacle(1: string id)
  ReturnCode setDoor(1: string id, 2: bool open)
  ReturnCode setTimeFactor(1: double factor)                   // simulated seconds per second; 0: as fast as possible
  ReturnCode setPaused(1: bool paused)
  double     step(1: double seconds)                           // paused or not; returns simulated time
  ReturnCode reset(1: i64 seed)                                // back to the start and to simulated time 0; the clock's settings stay
}

// Of a simulator in a process of its own: so that a recording of a run can be gone on with in the middle.
service KeptSimulation extends Simulation {
  binary remember() (idempotent = "true")  // the world and the clock's time, in Sentree's own form
}
