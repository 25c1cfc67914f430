// Decodes datagrams with protobufjs, by nothing but the .proto texts in a folder.
// Takes the folder and a file of JSON: the datagrams in base64. Prints JSON: each one decoded, and encoded again.
const fs = require("node:fs");
const path = require("node:path");
const protobuf = require("protobufjs");

function datagramType(folder) {
  const root = new protobuf.Root();
  root.resolvePath = (_, name) => (path.isAbsolute(name) ? name : path.join(folder, name));
  return root.loadSync("pbrg/datagram.proto", { keepCase: true }).lookupType("pbrg.Datagram");
}

const [folder, file] = process.argv.slice(2);
const type = datagramType(folder);
const options = { longs: String, bytes: String, json: true, arrays: true, oneofs: true };
const found = JSON.parse(fs.readFileSync(file, "utf-8")).map((text) => {
  const message = type.decode(Buffer.from(text, "base64"));
  return { decoded: type.toObject(message, options), encoded: Buffer.from(type.encode(message).finish()).toString("base64") };
});
process.stdout.write(JSON.stringify(found));
