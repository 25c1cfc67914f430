// Decodes every message of every channel with @mcap/core and protobufjs, by nothing but the schemas in the file.
// Prints JSON: per channel the schema's name, how many messages there are, and the first and the last one decoded.
const fs = require("node:fs/promises");
const zlib = require("node:zlib");
const { McapIndexedReader } = require("@mcap/core");
const { decompress } = require("lz4js");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");

class File {
  constructor(handle) {
    this.handle = handle;
  }
  async size() {
    return BigInt((await this.handle.stat()).size);
  }
  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    await this.handle.read(buffer, 0, buffer.length, Number(offset));
    return buffer;
  }
}

function typeOf(schema) {
  const set = descriptor.FileDescriptorSet.decode(schema.data);
  return protobuf.Root.fromDescriptor(set).lookupType(schema.name);
}

function plain(type, message) {
  return type.toObject(message, { longs: String, enums: Number, bytes: String, defaults: true });
}

async function main(path) {
  const handle = await fs.open(path);
  const decompressHandlers = {
    lz4: (data, size) => decompress(data, Number(size)),
    zstd: (data) => zlib.zstdDecompressSync(data),
  };
  const reader = await McapIndexedReader.Initialize({ readable: new File(handle), decompressHandlers });
  const types = new Map();
  const found = {};
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (!types.has(schema.id)) types.set(schema.id, typeOf(schema));
    const type = types.get(schema.id);
    const decoded = plain(type, type.decode(message.data));
    const entry = (found[channel.topic] ??= { schema: schema.name, count: 0, first: decoded });
    entry.count += 1;
    entry.last = decoded;
  }
  await handle.close();
  process.stdout.write(JSON.stringify(found));
}

main(process.argv[2]).catch((error) => {
  console.error(error);
  process.exit(1);
});
