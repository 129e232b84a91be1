service Cells { double charge(); }
service Hand { void close(); bool holds(); void squeeze(); }
