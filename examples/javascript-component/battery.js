#!/usr/bin/env node
'use strict';
// A component in JavaScript: serves a battery that loses one percent a second.
// See docs/how-to/component-in-another-language.md.

const thrift = require('thrift');
const { generate, options } = require('./generated');

const chosen = options({ port: '0', compact: false, framed: false });
const { Battery, types } = generate(chosen.interfaces);
const started = process.uptime();

const handler = {
  getBatteryCharge: () => Math.max(0, 100 - (process.uptime() - started)),
  isCharging: () => false,
  getBatteryState() {
    const charge = handler.getBatteryCharge() / 100;
    return new types.BatteryState({
      header: new types.Header({ stamp: process.uptime() - started, frame_id: 'base_link' }),
      voltage: 22 + 4 * charge,
      current: -1.5,
      percentage: charge,
      temperature: 25,
      power_supply_status: types.PowerSupplyStatus.DISCHARGING,
      warning: types.BatteryWarning.NONE,
      present: true,
    });
  },
};
const promised = Object.fromEntries(Object.entries(handler).map(([name, method]) => [name, async () => method()]));

const server = thrift.createServer(Battery, promised, {
  transport: chosen.framed ? thrift.TFramedTransport : thrift.TBufferedTransport,
  protocol: chosen.compact ? thrift.TCompactProtocol : thrift.TBinaryProtocol,
});
server.listen(Number(chosen.port), '127.0.0.1', () => console.log(`listening at tcp://127.0.0.1:${server.address().port}`));
