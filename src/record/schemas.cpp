#include "sentree/record/schemas.h"

namespace sentree::record::schemas {

const std::string_view kGap =
    R"~({"title":"sentree.Gap","type":"object","properties":{"lost":{"type":"integer",)~"
    R"~("description":"Messages that were not recorded, because the disk was too slow"},)~"
    R"~("from":{"type":"number","description":"Time of the first [s]"},"to":{"type":"number",)~"
    R"~("description":"Time of the last [s]"}}})~";

const std::string_view kObservation =
    R"~({"title":"sentree.Observation","type":"object","description":"One message that passed between tree,)~"
    R"~( skills and components","properties":{"sequence":{"type":"integer",)~"
    R"~("description":"Place in the total order, from 1"},"time":{"type":"number",)~"
    R"~("description":"Run time [s]"},"stamp":{"type":"integer","description":"Lamport stamp"},)~"
    R"~("kind":{"enum":["request","reply","error","event"]},"source":{"type":"string"},)~"
    R"~("target":{"type":"string"},"name":{"type":"string"},"call":{"type":"integer",)~"
    R"~("description":"Joins a request with its outcome"},"tick":{"type":"integer","description":"Root tick,)~"
    R"~( from 1"},"data":{"description":"What is particular to it"}}})~";

const std::string_view kTree =
    R"~({"title":"sentree.Tree","type":"object","description":"The tree as the tick left it",)~"
    R"~("properties":{"tick":{"type":"integer"},"status":{"type":"object",)~"
    R"~("description":"By path of the node, those that are not idle",)~"
    R"~("additionalProperties":{"enum":["RUNNING","SUCCESS","FAILURE","SKIPPED"]}}}})~";

const std::string_view kChart =
    R"~({"title":"sentree.Chart","type":"object",)~"
    R"~("description":"A skill's chart whose configuration changed","properties":{"leaf":{"type":"string"},)~"
    R"~("running":{"type":"boolean"},"states":{"type":"array","items":{"type":"string"},)~"
    R"~("description":"Active states in document order"},)~"
    R"~("last":{"type":"integer","description":"The transition taken last, by its place in the document"},)~"
    R"~("event":{"type":"string","description":"The event that it got last"},)~"
    R"~("data":{"type":"object","description":"Values of its data, while it runs"}}})~";

const std::string_view kMonitor =
    R"~({"title":"sentree.Monitor","type":"object","description":"A monitor whose configuration or data changed",)~"
    R"~("properties":{"monitor":{"type":"string"},"verdict":{"enum":["undecided","violated","satisfied"]},)~"
    R"~("states":{"type":"array","items":{"type":"string"}},"standing":{"type":"string",)~"
    R"~("description":"Why it is undecided"},"deadline":{"type":"integer",)~"
    R"~("description":"When silence will decide [ns]"},"violations":{"type":"integer"},)~"
    R"~("event":{"type":"string","description":"The observation that it got; none: time passed"},)~"
    R"~("data":{"type":"object","description":"Values of its data"}}})~";

const std::string_view kSnapshot =
    R"~({"title":"sentree.Snapshot","type":"object",)~"
    R"~("description":"Everything that is needed to go on from here",)~"
    R"~("properties":{"sequence":{"type":"integer","description":"The last observation before it"},)~"
    R"~("tick":{"type":"integer"},"state":{"description":"In virtual time: the whole run, Zstandard, base64; size: of it unpacked; else its parts"},)~"
    R"~("tree":{"description":"The tree's state, base64"},)~"
    R"~("skills":{"type":"object","description":"By leaf: its chart's session"},"monitors":{"type":"object",)~"
    R"~("description":"By name; history: how many observations still matter"},)~"
    R"~("world":{"description":"The simulated world"}}})~";

const std::string_view kBattery =
    R"~({"title":"sentree.Battery","type":"object","properties":{"percent":{"type":"number"},)~"
    R"~("current_A":{"type":"number"},"charging":{"type":"boolean"},"voltage_V":{"type":"number"},)~"
    R"~("plugged":{"type":"boolean"}}})~";

const std::string_view kMotion =
    R"~({"title":"sentree.Motion","type":"object","description":"How a robot moves, and where to",)~"
    R"~("properties":{"speed":{"type":"number","description":"[m/s]"},"turn":{"type":"number",)~"
    R"~("description":"[rad/s]"},"status":{"type":"string","description":"Of its navigation"},)~"
    R"~("goal":{"type":"array","items":{"type":"number"},"description":"x, y [m], heading [rad]; absent: none"}}})~";

const std::string_view kBlackboard =
    R"~({"title":"sentree.Blackboard","type":"object","description":"The tree's entries: by the path of the SubTree)~"
    R"~( that owns them, then by name","additionalProperties":{"type":"object"}})~";

const std::string_view kViolation =
    R"~({"title":"sentree.Violation","type":"object","properties":{"monitor":{"type":"string"},)~"
    R"~("time":{"type":"integer","description":"[ns]"},"sequence":{"type":"integer",)~"
    R"~("description":"Of the observation that decided; 0: a deadline passed in silence"},)~"
    R"~("story":{"type":"string"},"witness":{"type":"array","items":{"type":"object"}},)~"
    R"~("witness_complete":{"type":"boolean","description":"False: what was long before is not known any more"},)~"
    R"~("witness_minimal":{"type":"boolean","description":"Leaving out any one would not give this verdict"},)~"
    R"~("explanation":{"description":"Of a monitor that was written from a requirement"}}})~";

const std::string_view kPose =
    R"~({"title":"foxglove.PoseInFrame","type":"object","properties":{"timestamp":{"type":"object",)~"
    R"~("title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer",)~"
    R"~("minimum":0,"maximum":999999999}}},"frame_id":{"type":"string"},"pose":{"title":"foxglove.Pose",)~"
    R"~("type":"object","properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}})~";

const std::string_view kPath =
    R"~({"title":"foxglove.PosesInFrame","type":"object","properties":{"timestamp":{"type":"object",)~"
    R"~("title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer",)~"
    R"~("minimum":0,"maximum":999999999}}},"frame_id":{"type":"string"},"poses":{"type":"array",)~"
    R"~("items":{"title":"foxglove.Pose","type":"object",)~"
    R"~("properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}})~";

const std::string_view kScan =
    R"~({"title":"foxglove.LaserScan","type":"object","properties":{"timestamp":{"type":"object",)~"
    R"~("title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer",)~"
    R"~("minimum":0,"maximum":999999999}}},"frame_id":{"type":"string"},"pose":{"title":"foxglove.Pose",)~"
    R"~("type":"object","properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)~"
    R"~("start_angle":{"type":"number"},"end_angle":{"type":"number"},"ranges":{"type":"array",)~"
    R"~("items":{"type":"number"},"description":"[m]; 0: nothing within range"},)~"
    R"~("intensities":{"type":"array","items":{"type":"number"}}}})~";

const std::string_view kGrid =
    R"~({"title":"foxglove.Grid","type":"object","properties":{"timestamp":{"type":"object","title":"time",)~"
    R"~("properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,)~"
    R"~("maximum":999999999}}},"frame_id":{"type":"string"},"pose":{"title":"foxglove.Pose","type":"object",)~"
    R"~("properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)~"
    R"~("column_count":{"type":"integer"},"cell_size":{"title":"foxglove.Vector2","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"}}},"row_stride":{"type":"integer"},)~"
    R"~("cell_stride":{"type":"integer"},"fields":{"type":"array",)~"
    R"~("items":{"title":"foxglove.PackedElementField","type":"object",)~"
    R"~("properties":{"name":{"type":"string"},"offset":{"type":"integer"},)~"
    R"~("type":{"title":"foxglove.NumericType","oneOf":[{"title":"UNKNOWN","const":0},{"title":"UINT8",)~"
    R"~("const":1},{"title":"INT8","const":2},{"title":"UINT16","const":3},{"title":"INT16","const":4},)~"
    R"~({"title":"UINT32","const":5},{"title":"INT32","const":6},{"title":"FLOAT32","const":7},)~"
    R"~({"title":"FLOAT64","const":8}]}}}},"data":{"type":"string","contentEncoding":"base64"}}})~";

const std::string_view kLog =
    R"~({"title":"foxglove.Log","type":"object","properties":{"timestamp":{"type":"object","title":"time",)~"
    R"~("properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer","minimum":0,)~"
    R"~("maximum":999999999}}},"level":{"title":"foxglove.LogLevel","oneOf":[{"title":"UNKNOWN","const":0},)~"
    R"~({"title":"DEBUG","const":1},{"title":"INFO","const":2},{"title":"WARNING","const":3},)~"
    R"~({"title":"ERROR","const":4},{"title":"FATAL","const":5}]},"message":{"type":"string"},)~"
    R"~("name":{"type":"string"},"file":{"type":"string"},"line":{"type":"integer"}}})~";

const std::string_view kScene =
    R"~({"title":"foxglove.SceneUpdate","type":"object","properties":{"deletions":{"type":"array",)~"
    R"~("items":{"title":"foxglove.SceneEntityDeletion","type":"object",)~"
    R"~("properties":{"timestamp":{"type":"object","title":"time","properties":{"sec":{"type":"integer",)~"
    R"~("minimum":0},"nsec":{"type":"integer","minimum":0,"maximum":999999999}}},)~"
    R"~("type":{"title":"foxglove.SceneEntityDeletionType","oneOf":[{"title":"MATCHING_ID","const":0},)~"
    R"~({"title":"ALL","const":1}]},"id":{"type":"string"}}}},"entities":{"type":"array",)~"
    R"~("items":{"title":"foxglove.SceneEntity","type":"object","properties":{"timestamp":{"type":"object",)~"
    R"~("title":"time","properties":{"sec":{"type":"integer","minimum":0},"nsec":{"type":"integer",)~"
    R"~("minimum":0,"maximum":999999999}}},"frame_id":{"type":"string"},"id":{"type":"string"},)~"
    R"~("lifetime":{"type":"object","title":"duration","properties":{"sec":{"type":"integer"},)~"
    R"~("nsec":{"type":"integer","minimum":0,"maximum":999999999}}},"frame_locked":{"type":"boolean"},)~"
    R"~("metadata":{"type":"array","items":{"title":"foxglove.KeyValuePair","type":"object",)~"
    R"~("properties":{"key":{"type":"string"},"value":{"type":"string"}}}},"cubes":{"type":"array",)~"
    R"~("items":{"title":"foxglove.CubePrimitive","type":"object",)~"
    R"~("properties":{"pose":{"title":"foxglove.Pose","type":"object",)~"
    R"~("properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)~"
    R"~("size":{"title":"foxglove.Vector3","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"}}},"color":{"title":"foxglove.Color","type":"object",)~"
    R"~("properties":{"r":{"type":"number"},"g":{"type":"number"},"b":{"type":"number"},)~"
    R"~("a":{"type":"number"}}}}}},"cylinders":{"type":"array",)~"
    R"~("items":{"title":"foxglove.CylinderPrimitive","type":"object",)~"
    R"~("properties":{"pose":{"title":"foxglove.Pose","type":"object",)~"
    R"~("properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)~"
    R"~("size":{"title":"foxglove.Vector3","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"}}},"bottom_scale":{"type":"number"},)~"
    R"~("top_scale":{"type":"number"},"color":{"title":"foxglove.Color","type":"object",)~"
    R"~("properties":{"r":{"type":"number"},"g":{"type":"number"},"b":{"type":"number"},)~"
    R"~("a":{"type":"number"}}}}}},"texts":{"type":"array","items":{"title":"foxglove.TextPrimitive",)~"
    R"~("type":"object","properties":{"pose":{"title":"foxglove.Pose","type":"object",)~"
    R"~("properties":{"position":{"title":"foxglove.Vector3","type":"object",)~"
    R"~("properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},)~"
    R"~("orientation":{"title":"foxglove.Quaternion","type":"object","properties":{"x":{"type":"number"},)~"
    R"~("y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}},)~"
    R"~("billboard":{"type":"boolean"},"font_size":{"type":"number"},"scale_invariant":{"type":"boolean"},)~"
    R"~("color":{"title":"foxglove.Color","type":"object","properties":{"r":{"type":"number"},)~"
    R"~("g":{"type":"number"},"b":{"type":"number"},"a":{"type":"number"}}},"text":{"type":"string"}}}}}}}}})~";

}  // namespace sentree::record::schemas
