// Browsers start no worker for a page read from disk: this one runs in a hidden frame, so that the search works there, too.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.waiting = [];
      const frame = document.createElement("iframe");
      frame.hidden = true;
      document.body.append(frame);
      this.scope = frame.contentWindow;
      this.scope.postMessage = (data) => this.dispatchEvent(new MessageEvent("message", { data }));
      this.scope.importScripts = (...urls) => urls.reduce((before, one) => before.then(() => this.load(one)), Promise.resolve());
      this.load(url).then(() => { this.ready = true; this.waiting.forEach((data) => this.hand(data)); });
    }
    load(url) {
      return new Promise((done, failed) => {
        const script = this.scope.document.createElement("script");
        script.src = new URL(url, location.href).href;
        script.onload = done;
        script.onerror = failed;
        this.scope.document.head.append(script);
      });
    }
    hand(data) { this.scope.dispatchEvent(new MessageEvent("message", { data })); }
    postMessage(data) { if (this.ready) this.hand(data); else this.waiting.push(data); }
    terminate() { this.scope.frameElement.remove(); }
  };
}
