// Search in a page that was opened as a file: browsers let it neither fetch the index nor start a worker. The index is a
// script then (beside this one, before it), and a worker is an unseen frame, whose messages are events.
window.__search = { index: Promise.resolve(window.sentreeSearchIndex) };
window.Worker = class extends EventTarget {
  constructor(url) {
    super();
    const frame = document.createElement("iframe");
    frame.hidden = true;
    document.body.append(frame);
    const inside = frame.contentWindow;
    const run = (source) =>
      new Promise((done, failed) => {
        const script = inside.document.createElement("script");
        Object.assign(script, { src: source, onload: done, onerror: failed });
        inside.document.body.append(script);
      });
    inside.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
    inside.importScripts = (...sources) => sources.reduce((before, source) => before.then(() => run(source)), Promise.resolve());
    this.inside = inside;
    this.ready = run(new URL(url, document.baseURI).href);
  }
  postMessage(data) {
    this.ready.then(() => this.inside.dispatchEvent(new MessageEvent("message", { data })));
  }
  terminate() {}
};
