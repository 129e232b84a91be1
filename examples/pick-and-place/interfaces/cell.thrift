enum ArmStatus { IDLE, MOVING, HOLDING, EMPTY }   // EMPTY: it closed on nothing

service Camera {
  string findPart()                 // its name; "" when the table is empty
}

// Movements are begun by a call and looked after by getStatus.
service Arm {
  void pick(1: string part)         // MOVING, then HOLDING or EMPTY
  void place(1: string bin)         // MOVING, then IDLE
  void home()                       // MOVING, then IDLE
  ArmStatus getStatus()
}
