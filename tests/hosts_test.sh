#!/usr/bin/env bash
# hosts_test.sh SENTREE SOURCE_DIR WORK_DIR: experiment 1 on two hosts, which are two network namespaces with clocks that differ by hours,
# through a relay that delays, stalls and cuts connections. 77 (skipped) unless root, with ip, unshare and nsenter.
set -euo pipefail
sentree=$1 source=$2 work=$3
if [[ $(id -u) -ne 0 ]]; then echo "SKIPPED: network namespaces need root" && exit 77; fi
for tool in ip unshare nsenter /usr/bin/python3; do
  if ! command -v $tool >/dev/null; then echo "SKIPPED: $tool is not installed" && exit 77; fi
done
if ! unshare --net true 2>/dev/null; then echo "SKIPPED: network namespaces are not allowed here" && exit 77; fi
rm -rf "$work" && mkdir -p "$work"
export XDG_RUNTIME_DIR=$work
seed=${SEED:-$RANDOM}
echo "seed $seed"

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
start relay_here "${on_here[@]}" /usr/bin/python3 "$source/tests/relay.py" "$seed" 10.77.0.1:19090=10.77.0.2:9090 10.77.0.1:19091=10.77.0.2:9091
start relay_there "${on_there[@]}" /usr/bin/python3 "$source/tests/relay.py" "$seed" 10.77.0.2:19100=10.77.0.1:9100
start robot "${on_there[@]}" "$sentree" component sim --project "$source/tests/scenarios/hosts.yaml" --listen tcp://10.77.0.2:9090 --insecure --factor 10
start skill "${on_there[@]}" "$sentree" skill "$source/tests/scenarios/hosts.yaml" GoToLocation --listen tcp://10.77.0.2:9091 --insecure \
  --factor 10 --observer tcp://10.77.0.2:19100 --at navigation=tcp://10.77.0.2:9090 --at battery=tcp://10.77.0.2:9090

code=0
"${on_here[@]}" "$sentree" run "$source/tests/scenarios/hosts.yaml" --listen tcp://10.77.0.1:9100 --insecure >"$work/run.log" 2>&1 || code=$?
tail -12 "$work/run.log"
kill "${children[2]}" "${children[3]}"
wait "${children[2]}" "${children[3]}" || true
tail -n 1 "$work/relay_here.log" "$work/relay_there.log"
[[ $code -eq 1 ]] && grep -q '✗ monitor battery: violated' "$work/run.log" && grep -q '· monitor recharge: undecided' "$work/run.log"
