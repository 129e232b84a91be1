namespace cpp bench

enum Status { IDLE = 0, MOVING = 1 }
struct State {
  1: double stamp = 0, 2: string frame = "", 3: double x = 0, 4: double y = 0, 5: Status status = Status.MOVING, 6: i64 goal = 0, 7: string target = ""
}
service Robot {
  void ping()
  State echo(1: State state)
}
