service Gripper {
  bool isPulled()   // somebody pulls at what it holds
  void open()
}
