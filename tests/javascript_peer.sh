#!/usr/bin/env bash
# javascript_peer.sh SENTREE SOURCE_DIR WORK_DIR: the example in JavaScript as a peer, with the npm package `thrift`: our client
# calls its component, its client calls ours, in both protocols, framed and not. 77 (skipped) without npm or network.
set -euo pipefail
sentree=$1 source=$2 work=$3
for tool in node npm thrift; do
  if ! command -v $tool >/dev/null; then echo "SKIPPED: $tool is not installed" && exit 77; fi
done
mkdir -p "$work"
cp "$source"/examples/javascript-component/*.js* "$work"
cd "$work"
if ! npm ci --silent --no-audit --no-fund >npm.log 2>&1; then
  echo "SKIPPED: the npm package thrift cannot be fetched: $(tail -1 npm.log)"
  exit 77
fi

child=
trap '[[ -n $child ]] && kill $child 2>/dev/null || true' EXIT
# Starts a server in the background and waits for the port that it prints.
serve() {
  : >server.log
  "$@" >server.log 2>&1 &
  child=$!
  until grep -q '^listening' server.log; do
    kill -0 $child 2>/dev/null || { cat server.log && exit 1; }
    read -rt 0.05 <> <(:) || true
  done
  port=$(sed -n 's/^listening .*127.0.0.1:\([0-9]*\).*/\1/p' server.log)
}
stop() {
  kill $child 2>/dev/null || true
  wait $child 2>/dev/null || true
  child=
}

for options in "" "--compact" "--framed" "--compact --framed"; do
  parameters=
  [[ $options == *compact* ]] && parameters='?protocol=compact'
  [[ $options == *framed* ]] && parameters="${parameters:+$parameters&}" && parameters="${parameters:-?}transport=framed"
  # shellcheck disable=SC2086
  serve node battery.js --interfaces "$source/interfaces" $options
  state=$("$sentree" call "tcp://127.0.0.1:$port$parameters" getBatteryState --interface robot.thrift/Battery)
  stop
  [[ $state == *'"power_supply_status":"DISCHARGING"'* ]] || { echo "our client, $options: $state" && exit 1; }

  serve "$sentree" component sim --world "$source/examples/recharge/world/world.yaml" --listen tcp://127.0.0.1:0
  # shellcheck disable=SC2086
  state=$(node ask_battery.js --interfaces "$source/interfaces" --port "$port" --service battery $options)
  stop
  [[ $state =~ ^[0-9.]+\ %,\ DISCHARGING$ ]] || { echo "our server, $options: $state" && exit 1; }
  echo "✓ both ways ${options:-as is}"
done
