export function MessagesPanel() {
  return <div className="empty">Messages</div>;
}
