service Battery {
  oneway void state(1: double percentage (unit = "%"), 2: bool charging)
}
service Notices {
  oneway void said(1: string text)
}
