#!/usr/bin/env node
'use strict';
// A client in JavaScript: asks a battery how full it is, e.g. the simulated one:
//   sentree component sim --world examples/recharge/world/world.yaml --listen tcp://127.0.0.1:9090

const thrift = require('thrift');
const { generate, options } = require('./generated');

const chosen = options({ port: '9090', service: '', compact: false, framed: false });
const { Battery, types } = generate(chosen.interfaces);

const connection = thrift.createConnection('127.0.0.1', Number(chosen.port), {
  transport: chosen.framed ? thrift.TFramedTransport : thrift.TBufferedTransport,
  protocol: chosen.compact ? thrift.TCompactProtocol : thrift.TBinaryProtocol,
});
connection.on('error', (error) => {
  console.error(error.message);
  process.exitCode = 1;
});
// A server of several services is asked for one by its name.
const client = chosen.service
  ? new thrift.Multiplexer().createClient(chosen.service, Battery, connection)
  : thrift.createClient(Battery, connection);

client.getBatteryState().then((state) => {
  const name = Object.keys(types.PowerSupplyStatus).find((key) => types.PowerSupplyStatus[key] === state.power_supply_status);
  console.log(`${(state.percentage * 100).toFixed(1)} %, ${name}`);
  connection.end();
});
