// What the twelve requirements are about beside robot.thrift: an arm with a gripper, and a safety controller.
enum GripperState { OPEN = 0, MOVING = 1, CLOSED = 2 }
struct ArmState { 1: bool moving, 2: GripperState gripper }
service Arm {
  ArmState getArmState()
  bool     pick(1: string object)
  bool     place(1: string object)
}
service Safety {
  void halt()    // asks the base to stand still
  void stop()    // emergency stop
  void reset()
}
