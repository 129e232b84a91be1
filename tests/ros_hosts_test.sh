#!/usr/bin/env bash
# ros_hosts_test.sh SENTREE SOURCE_DIR WORK_DIR: nodes of ROS 2 on two hosts between which nothing is multicast find each other by ROS_STATIC_PEERS,
# and not without it. 77 (skipped) where two_hosts.sh cannot make the hosts, or ROS 2 is not built.
set -euo pipefail
sentree=$1 source=$2 work=$3
export ROS_DOMAIN_ID=0 ROS_LOCALHOST_ONLY='' ROS_AUTOMATIC_DISCOVERY_RANGE='' ROS_STATIC_PEERS=''
if "$sentree" services --on ros: 2>&1 >/dev/null | grep -q 'is not there\|cannot be loaded'; then echo "SKIPPED: without ROS 2" && exit 77; fi
# shellcheck source=tests/two_hosts.sh
source "$source/tests/two_hosts.sh"
for host in here there; do
  declare -n on="on_$host"
  "${on[@]}" ip link set "sentree$([[ $host == here ]] && echo 0 || echo 1)" multicast off
done

start robot "${on_there[@]}" env ROS_STATIC_PEERS=10.77.0.1 "$sentree" sim --world "$source/examples/recharge/world/world.yaml" --ros --headless
grep -q 'all machines of the network.*10.77.0.1' "$work/robot.log"
battery=(call "ros:/battery" getBatteryCharge --interface "$source/interfaces/robot.thrift/Battery")
if "${on_here[@]}" "$sentree" "${battery[@]}" >"$work/alone.log" 2>&1; then cat "$work/alone.log" && exit 1; fi
"${on_here[@]}" env ROS_STATIC_PEERS="10.77.0.9;10.77.0.2" "$sentree" "${battery[@]}" | tee "$work/call.log"
grep -Eq '[0-9]' "$work/call.log"
