// Cells of the yard are counted from its corner.
struct Cell { 1: i32 x, 2: i32 y }

service Base {
  Cell ahead()        // the next cell on a shortest way to where the errand ends
  bool go(1: Cell to) // one cell on; whether the errand ends there
}

service Desk {
  i32 errand() // the errand to do now, of those that are open; when none is, all three are again
}

service People {
  bool isIn(1: Cell cell)
}
