'use strict';
// Thrift's compiler writes the modules from the IDL; here at each start, to where they find the npm package `thrift`.

const { execFileSync } = require('node:child_process');
const fs = require('node:fs');
const path = require('node:path');

const folder = path.join(__dirname, 'node_modules', '.robot');

function generate(interfaces) {
  fs.mkdirSync(folder, { recursive: true });
  execFileSync('thrift', ['--gen', 'js:node', '-out', folder, path.join(interfaces, 'robot.thrift')]);
  return { Battery: require(path.join(folder, 'Battery')), types: require(path.join(folder, 'robot_types')) };
}

// Minimal options: --name value, or --flag.
function options(defaults) {
  const result = { interfaces: path.join(__dirname, '..', '..', 'interfaces'), ...defaults };
  const words = process.argv.slice(2);
  while (words.length > 0) {
    const name = words.shift().replace(/^--/, '');
    if (!(name in result)) throw new Error(`unknown option --${name}; there are ${Object.keys(result).join(', ')}`);
    result[name] = typeof result[name] === 'boolean' ? true : words.shift();
  }
  return result;
}

module.exports = { generate, options };
