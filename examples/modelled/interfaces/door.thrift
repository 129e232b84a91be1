// A door that opens slowly, and a lamp.
enum DoorState { CLOSED = 0, MOVING = 1, OPEN = 2 }
service Door {
  bool      open()             // false: somebody holds it closed
  DoorState getState()
}
service Lamp {
  void turn(1: bool on)
  i32  brightness() (unit = "%")
}
