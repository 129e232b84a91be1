/** The types of what protocol.ts describes. */
import type { Static } from "@sinclair/typebox";

import type * as protocol from "./protocol";

export { kStatuses } from "./statuses";
import type { kStatuses } from "./statuses";

export type StatusName = (typeof kStatuses)[number];
export type Data = null | boolean | number | string | Data[] | { [key: string]: Data };

export type Time = Static<typeof protocol.Time>;
export type Pose = Static<typeof protocol.Pose>;
export type Point = Static<typeof protocol.Point>;
export type Hello = Static<typeof protocol.Hello>;
export type NodeKind = Static<typeof protocol.NodeKind>;
export type TreeNode = Static<typeof protocol.TreeNode>;
export type Size = Static<typeof protocol.Size>;
export type Rect = Static<typeof protocol.Rect>;
export type TreeLayout = Static<typeof protocol.TreeLayout>;
export type TreeModel = Static<typeof protocol.TreeModel>;
export type ChartLayout = Static<typeof protocol.ChartLayout>;
export type ChartModel = Static<typeof protocol.ChartModel>;
export type MonitorModel = Static<typeof protocol.MonitorModel>;
export type IdlField = Static<typeof protocol.IdlField>;
export type IdlType = Static<typeof protocol.IdlType>;
export type IdlTypes = Static<typeof protocol.IdlTypes>;
export type IdlMethod = Static<typeof protocol.IdlMethod>;
export type ServiceModel = Static<typeof protocol.ServiceModel>;
export type Location = Static<typeof protocol.Location>;
export type Station = Static<typeof protocol.Station>;
export type LaserModel = Static<typeof protocol.LaserModel>;
export type WorldModel = Static<typeof protocol.WorldModel>;
export type Part = Static<typeof protocol.Part>;
export type Model = Static<typeof protocol.Model>;
export type RunState = Static<typeof protocol.RunState>;
export type TreeState = Static<typeof protocol.TreeState>;
export type ChartState = Static<typeof protocol.ChartState>;
export type Verdict = Static<typeof protocol.Verdict>;
export type MonitorState = Static<typeof protocol.MonitorState>;
export type Battery = Static<typeof protocol.Battery>;
export type RobotState = Static<typeof protocol.RobotState>;
export type Obstacle = Static<typeof protocol.Obstacle>;
export type Door = Static<typeof protocol.Door>;
export type State = Static<typeof protocol.State>;
export type Kind = Static<typeof protocol.Kind>;
export type Observation = Static<typeof protocol.Observation>;
export type Delta = Static<typeof protocol.Delta>;
export type Violation = Static<typeof protocol.Violation>;
export type Problem = Static<typeof protocol.Problem>;
export type Filter = Static<typeof protocol.Filter>;
export type Lane = Static<typeof protocol.Lane>;
export type Mark = Static<typeof protocol.Mark>;
export type TextEdit = Static<typeof protocol.TextEdit>;
export type FileKind = Static<typeof protocol.FileKind>;
export type DesignFile = Static<typeof protocol.DesignFile>;
export type Finding = Static<typeof protocol.Finding>;
export type Design = Static<typeof protocol.Design>;
export type OutlineNode = Static<typeof protocol.OutlineNode>;
export type OutlineTree = Static<typeof protocol.OutlineTree>;
export type OutlineChart = Static<typeof protocol.OutlineChart>;
export type DesignDocument = Static<typeof protocol.DesignDocument>;
export type DesignPast = Static<typeof protocol.DesignPast>;
export type PaletteNode = Static<typeof protocol.PaletteNode>;
export type Gesture = Static<typeof protocol.Gesture>;
export type FoldedChart = Static<typeof protocol.FoldedChart>;
export type PlayedChart = Static<typeof protocol.PlayedChart>;
export type PlayedTree = Static<typeof protocol.PlayedTree>;
export type PartMark = Static<typeof protocol.PartMark>;
export type Change = Static<typeof protocol.Change>;
export type Comparison = Static<typeof protocol.Comparison>;
export type ComparedFile = Static<typeof protocol.ComparedFile>;
export type Interventions = Static<typeof protocol.Interventions>;

/** By operation: what is sent beside `op` and `id`, and the value of the answer. */
export type Operations = { [Op in keyof typeof protocol.Operations]: [Static<(typeof protocol.Operations)[Op][0]>, Static<(typeof protocol.Operations)[Op][1]>] };
export type Operation = keyof Operations;
export type ServerMessage = { [Name in keyof typeof protocol.ServerMessages]: Static<(typeof protocol.ServerMessages)[Name]> }[keyof typeof protocol.ServerMessages];
