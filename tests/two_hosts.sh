# shellcheck shell=bash
# To be sourced with $work, a folder that is made anew: two hosts, which are two network namespaces with clocks that differ by hours. Commands
# run there behind "${on_here[@]}" (10.77.0.1) and "${on_there[@]}" (10.77.0.2), start begins a part of them. Exits with 77 (skipped) unless root,
# with ip, unshare and nsenter.
if [[ $(id -u) -ne 0 ]]; then echo "SKIPPED: network namespaces need root" && exit 77; fi
for tool in ip unshare nsenter; do
  if ! command -v $tool >/dev/null; then echo "SKIPPED: $tool is not installed" && exit 77; fi
done
if ! unshare --net true 2>/dev/null; then echo "SKIPPED: network namespaces are not allowed here" && exit 77; fi
rm -rf "${work:?}" && mkdir -p "$work"
export XDG_RUNTIME_DIR=$work

children=()
cleanup() {
  for child in "${children[@]}"; do kill "$child" 2>/dev/null || true; done
  wait 2>/dev/null || true
}
trap cleanup EXIT

# A host is a process that holds its namespaces; the second one's monotonic clock is ahead by more than five hours.
unshare --net sleep infinity &
children+=($!) here=$!
skew=(--time --monotonic 20000 --boottime 20000)
unshare "${skew[@]}" true 2>/dev/null || skew=()
unshare --net "${skew[@]}" sleep infinity &
children+=($!) there=$!
for host in $here $there; do
  until [[ $(readlink "/proc/$host/ns/net") != $(readlink /proc/self/ns/net) ]]; do kill -0 "$host"; done
done
ip link add sentree0 netns "$here" type veth peer name sentree1 netns "$there"
on_here=(nsenter "--net=/proc/$here/ns/net")
on_there=(nsenter "--net=/proc/$there/ns/net")
[[ ${#skew[@]} -gt 0 ]] && on_there+=("--time=/proc/$there/ns/time_for_children")
"${on_here[@]}" ip address add 10.77.0.1/24 dev sentree0
"${on_there[@]}" ip address add 10.77.0.2/24 dev sentree1
"${on_here[@]}" ip link set sentree0 up
"${on_there[@]}" ip link set sentree1 up
"${on_here[@]}" ip link set lo up
"${on_there[@]}" ip link set lo up

# Starts a part in the background and waits until it says that it is there.
start() {
  local name=$1
  shift
  : >"$work/$name.log"
  "$@" >"$work/$name.log" 2>&1 &
  children+=($!)
  until grep -Eq 'listening on|relaying' "$work/$name.log"; do
    kill -0 "${children[-1]}" 2>/dev/null || { cat "$work/$name.log" && exit 1; }
    read -rt 0.05 <> <(:) || true
  done
}
