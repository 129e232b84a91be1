#include "sentree/scxml/detail/script_values.h"

namespace sentree::scxml {

// Replaces what would not be the same in each run (clock, randomness, time zone), and adds In() and a small read-only
// DOM. Every built-in object is frozen behind it. Inherited members that scripts commonly override on their own objects
// (toString, message …) become accessors, because assignment to an inherited read-only member would fail.
const char* const kBootstrap = R"js((function (base, now, random, isIn) {
'use strict';
var define = Object.defineProperty;
function hidden(object, name, value) { define(object, name, {value: value, writable: true, enumerable: false, configurable: true}); }

delete base.Duktape;
delete base.performance;
hidden(base, 'In', function In(id) { return isIn(String(id)); });
hidden(Math, 'random', function () { return random(); });

var NativeDate = base.Date;
function Date(year, month, day, hours, minutes, seconds, ms) {
  if (!(this instanceof Date)) return new NativeDate(now()).toUTCString();
  switch (arguments.length) {
    case 0: return new NativeDate(now());
    case 1: return new NativeDate(year instanceof NativeDate ? year.getTime() : year);
    default: return new NativeDate(NativeDate.UTC(year, month, day === undefined ? 1 : day, hours || 0, minutes || 0, seconds || 0, ms || 0));
  }
}
Date.prototype = NativeDate.prototype;
hidden(Date.prototype, 'constructor', Date);
hidden(Date, 'now', function () { return now(); });
hidden(Date, 'parse', NativeDate.parse);
hidden(Date, 'UTC', NativeDate.UTC);
['FullYear', 'Month', 'Date', 'Day', 'Hours', 'Minutes', 'Seconds', 'Milliseconds'].forEach(function (part) {
  hidden(Date.prototype, 'get' + part, Date.prototype['getUTC' + part]);
  if (part !== 'Day') hidden(Date.prototype, 'set' + part, Date.prototype['setUTC' + part]);
});
hidden(Date.prototype, 'getTimezoneOffset', function () { return 0; });
['toString', 'toLocaleString'].forEach(function (name) { hidden(Date.prototype, name, Date.prototype.toUTCString); });
hidden(base, 'Date', Date);

function Element(tree) {
  var self = this;
  function fixed(name, value) { define(self, name, {value: value}); }
  fixed('nodeType', tree.document ? 9 : 1);
  fixed('nodeName', tree.name);
  fixed('tagName', tree.name);
  fixed('attributes', Object.freeze(tree.attributes));
  fixed('textContent', tree.text);
  fixed('source', tree.source);
  fixed('childNodes', Object.freeze(tree.children.map(function (child) {
    var element = new Element(child);
    define(element, 'parentNode', {value: self});
    return element;
  })));
  if (tree.document) fixed('documentElement', self.childNodes[0]);
}
function search(node, name, found) {
  node.childNodes.forEach(function (child) {
    if (name === '*' || child.tagName === name) found.push(child);
    search(child, name, found);
  });
  return found;
}
var methods = {
  getElementsByTagName: function (name) { return search(this, String(name), []); },
  getElementById: function (id) {
    return search(this, '*', []).filter(function (e) { return e.getAttribute('id') === String(id); })[0] || null;
  },
  getAttribute: function (name) { return this.hasAttribute(name) ? this.attributes[name] : null; },
  hasAttribute: function (name) { return Object.prototype.hasOwnProperty.call(this.attributes, name); },
  hasChildNodes: function () { return this.childNodes.length > 0; },
  toString: function () { return this.source; }
};
Object.keys(methods).forEach(function (name) { hidden(Element.prototype, name, methods[name]); });
define(Element.prototype, 'firstChild', {get: function () { return this.childNodes[0] || null; }});
define(Element.prototype, 'lastChild', {get: function () { return this.childNodes[this.childNodes.length - 1] || null; }});
define(Element.prototype, 'children', {get: function () { return this.childNodes; }});

function overridable(prototype, names) {
  names.forEach(function (name) {
    var descriptor = Object.getOwnPropertyDescriptor(prototype, name);
    if (!descriptor || !descriptor.configurable || !('value' in descriptor)) return;
    define(prototype, name, {
      get: function () { return descriptor.value; },
      set: function (value) {
        if (this === prototype) throw new TypeError('built-in objects are read-only');
        define(this, name, {value: value, writable: true, enumerable: true, configurable: true});
      },
      enumerable: false, configurable: false
    });
  });
}
overridable(Object.prototype, ['constructor', 'toString', 'toLocaleString', 'valueOf', 'hasOwnProperty', 'isPrototypeOf', 'propertyIsEnumerable']);
overridable(Function.prototype, ['constructor', 'toString']);
overridable(Array.prototype, ['toString']);
[Error, EvalError, RangeError, ReferenceError, SyntaxError, TypeError, URIError].forEach(function (type) {
  overridable(type.prototype, ['constructor', 'name', 'message', 'toString']);
});

function makeDom(tree) { return new Element(tree); }
makeDom.element = Element;
return makeDom;
}))js";

}  // namespace sentree::scxml
