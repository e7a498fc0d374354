// Archives of a few small files: read as they come, written without compression.

const LOCAL = 0x04034b50;
const ENTRY = 0x02014b50;
const END = 0x06054b50;
const DEFLATED = 8;
/** What an end record may have behind it. */
const LONGEST_COMMENT = 0xffff;

/**
 * The files of an archive by their names.
 * @param {ArrayBuffer} bytes
 * @returns {Promise<Map<string, Uint8Array<ArrayBuffer>>>}
 */
export async function readZip(bytes) {
  const view = new DataView(bytes);
  let end = bytes.byteLength - 22;
  const first = Math.max(0, end - LONGEST_COMMENT);
  while (end >= first && view.getUint32(end, true) !== END) end -= 1;
  if (end < first) throw new Error("The archive cannot be read: it has no list of its files.");
  const files = new Map();
  let at = view.getUint32(end + 16, true);
  for (let count = view.getUint16(end + 10, true); count > 0 && view.getUint32(at, true) === ENTRY; count -= 1) {
    const [method, packed] = [view.getUint16(at + 10, true), view.getUint32(at + 20, true)];
    const [name, extra, comment] = [28, 30, 32].map((of) => view.getUint16(at + of, true));
    const place = view.getUint32(at + 42, true);
    const begin = place + 30 + view.getUint16(place + 26, true) + view.getUint16(place + 28, true);
    const text = new TextDecoder().decode(new Uint8Array(bytes, at + 46, name));
    const body = new Blob([new Uint8Array(bytes, begin, packed)]);
    const read = method === DEFLATED ? body.stream().pipeThrough(new DecompressionStream("deflate-raw")) : body.stream();
    files.set(text, new Uint8Array(await new Response(read).arrayBuffer()));
    at += 46 + name + extra + comment;
  }
  return files;
}

/**
 * @param {[string, Uint8Array<ArrayBuffer>][]} files
 * @returns {Blob}
 */
export function writeZip(files) {
  /** @type {BlobPart[]} */
  const parts = [];
  const entries = [];
  let at = 0;
  for (const [name, bytes] of files) {
    const text = new TextEncoder().encode(name);
    // What both headers have: version, flags, method, time, date (1980-01-01, so that the same files are the same archive), sum, sizes, lengths.
    const shared = header(26, (view) => {
      view.setUint16(0, 20, true);
      view.setUint16(8, 0x21, true);
      view.setUint32(10, sumOf(bytes), true);
      view.setUint32(14, bytes.length, true);
      view.setUint32(18, bytes.length, true);
      view.setUint16(22, text.length, true);
    });
    parts.push(header(4, (view) => view.setUint32(0, LOCAL, true)), shared, text, bytes);
    const place = at;
    entries.push(
      header(6, (view) => {
        view.setUint32(0, ENTRY, true);
        view.setUint16(4, 20, true);
      }), shared, header(14, (view) => view.setUint32(10, place, true)), text);
    at += 30 + text.length + bytes.length;
  }
  const size = new Blob(entries).size;
  const end = header(22, (view) => {
    view.setUint32(0, END, true);
    view.setUint16(8, files.length, true);
    view.setUint16(10, files.length, true);
    view.setUint32(12, size, true);
    view.setUint32(16, at, true);
  });
  return new Blob([...parts, ...entries, end], { type: "application/zip" });
}

/**
 * @param {number} length
 * @param {(view: DataView) => void} fill
 */
function header(length, fill) {
  const bytes = new Uint8Array(length);
  fill(new DataView(bytes.buffer));
  return bytes;
}

/** The check sum that archives have. @param {Uint8Array} bytes */
function sumOf(bytes) {
  let sum = 0xffffffff;
  for (const byte of bytes) sum = (sum >>> 8) ^ TABLE[(sum ^ byte) & 0xff];
  return (sum ^ 0xffffffff) >>> 0;
}

const TABLE = Uint32Array.from({ length: 256 }, (_, index) => {
  let value = index;
  for (let bit = 0; bit < 8; bit += 1) value = value & 1 ? (value >>> 1) ^ 0xedb88320 : value >>> 1;
  return value;
});
