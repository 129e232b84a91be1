service Fleet {
  void dock(1: string robot)       // drives into the station
  bool isFull(1: string robot)
  void undock(1: string robot)     // out of the station, when the call has returned
}

service Station {
  bool claim(1: string robot)      // true: it is yours until you release it
  void release(1: string robot)
}
