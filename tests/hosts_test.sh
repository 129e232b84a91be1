#!/usr/bin/env bash
# hosts_test.sh SENTREE SOURCE_DIR WORK_DIR: experiment 1 on two hosts with clocks that differ by hours,
# through a relay that delays, stalls and cuts connections. 77 (skipped) where two_hosts.sh cannot make them.
set -euo pipefail
sentree=$1 source=$2 work=$3
if ! [[ -x /usr/bin/python3 ]]; then echo "SKIPPED: /usr/bin/python3 is not installed" && exit 77; fi
# shellcheck source=tests/two_hosts.sh
source "$source/tests/two_hosts.sh"
seed=${SEED:-$RANDOM}
echo "seed $seed"

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
