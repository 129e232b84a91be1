export function SteerPanel() {
  return <div className="empty">Steer</div>;
}
