enum DriveStatus { WAITING, MOVING, ARRIVED, BLOCKED }
enum DriveMode { CAREFUL, FAST }
enum Reason { NO_REASON, TOO_DARK }
struct Permission { 1: bool allowed; 2: Reason reason = Reason.NO_REASON }
service Wheels {
  Permission mayDrive(1: string place, 2: DriveMode mode);
  void drive(1: string place);
  DriveStatus status(1: string place);
  void stop(1: string place);
}
