// SPDX-License-Identifier: Apache-2.0
'use strict';

// Prints the metadata of an MCAP file, and its messages, each with its topic, the name of its schema, and its time in
// nanoseconds.
const fs = require('node:fs');
const { McapIndexedReader } = require('@mcap/core');

async function main(path) {
  const bytes = fs.readFileSync(path);
  const readable = { size: async () => BigInt(bytes.length),
    read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)) };
  const reader = await McapIndexedReader.Initialize({ readable });
  const messages = [];
  for await (const { metadata } of reader.readMetadata()) messages.push(Object.fromEntries(metadata));
  for await (const { channelId, logTime, data } of reader.readMessages({ validateCrcs: true })) {
    const { topic, schemaId, messageEncoding } = reader.channelsById.get(channelId);
    const { name, encoding, data: schema } = reader.schemasById.get(schemaId);
    const content = JSON.parse(Buffer.from(data));
    const { properties } = JSON.parse(Buffer.from(schema));
    const unknown = Object.keys(content).filter((key) => !(key in properties));
    if (encoding !== 'jsonschema' || messageEncoding !== 'json' || unknown.length) throw new Error(`${topic}: ${unknown}`);
    messages.push({ topic, schema: name, logTime: String(logTime), ...content });
  }
  console.log(JSON.stringify(messages));
}

main(...process.argv.slice(2));
