service Hand {
  void open()
  bool close()   // whether it holds something
}
