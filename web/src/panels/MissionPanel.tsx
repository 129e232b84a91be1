export function MissionPanel() {
  return <div className="empty">Mission</div>;
}
