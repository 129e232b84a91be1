#!/usr/bin/env bash
# cpp_peer.sh SENTREE SOURCE_DIR WORK_DIR: builds the example client in C++ with generated code as its user would, and lets it ask our component.
# 77 (skipped) without the Thrift compiler.
set -euo pipefail
sentree=$1 source=$2 work=$3
if ! command -v thrift >/dev/null; then echo "SKIPPED: thrift is not installed" && exit 77; fi
mkdir -p "$work"
if ! { cmake -S "$source/examples/cpp-client" -B "$work/build" && cmake --build "$work/build"; } >"$work/log" 2>&1; then
  cat "$work/log" && exit 1
fi

# Else the first look finds what an earlier run said.
: >"$work/component"
"$sentree" component sim --world "$source/examples/recharge/world/world.yaml" --listen "unix:$work/sim.sock" >"$work/component" 2>&1 &
component=$!
trap 'kill $component 2>/dev/null || true' EXIT
until grep -q 'listening on' "$work/component"; do
  kill -0 $component 2>/dev/null || { cat "$work/component" && exit 1; }
  read -rt 0.05 <> <(:) || true
done
state=$("$work/build/ask_battery" "$work/sim.sock" battery)
[[ $state =~ ^[0-9.]+\ base_link$ ]] || { echo "the battery: $state" && exit 1; }
# Without a name the first of the services is asked, which is none of its kind.
if "$work/build/ask_battery" "$work/sim.sock" >"$work/out" 2>&1; then echo "a call without a name was answered" && exit 1; fi
grep -q 'names no service' "$work/out" || { cat "$work/out" && exit 1; }
