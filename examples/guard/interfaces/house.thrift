/// Which window is open: floor and room; "" if none is.
struct Window {
  1: string floor,
  2: string room,
}

/// Where all windows of the house are seen.
service Panel {
  Window look(),
}

/// Who goes there and shuts it.
service Guard {
  /// The window is shut when it answers.
  void shut(1: string floor, 2: string room),
}
