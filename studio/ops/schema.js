// What a JSON Schema says of a field, as far as forms need it.

/** @typedef {Record<string, any>} Schema */

/**
 * A schema without references and without "or nothing".
 * @param {Schema} schema
 * @param {Schema} root
 * @returns {Schema}
 */
export function resolved(schema, root) {
  let own = schema;
  for (let depth = 0; own.$ref && depth < 8; depth += 1) {
    const { $ref, ...rest } = own;
    own = { ...root.$defs[$ref.slice("#/$defs/".length)], ...rest };
  }
  if (own.anyOf) {
    const kinds = own.anyOf.filter((/** @type {Schema} */ kind) => kind.type !== "null");
    if (kinds.length === 1) {
      const { anyOf: _, ...rest } = own;
      return { ...resolved(kinds[0], root), ...rest, isOptional: true };
    }
  }
  if (Array.isArray(own.type)) {
    const kinds = own.type.filter((/** @type {string} */ type) => type !== "null");
    if (kinds.length === 1) return { ...own, type: kinds[0], isOptional: true };
  }
  return own;
}

/**
 * The words of a closed set; nothing where it is none.
 * @param {Schema} schema
 * @param {Schema} root
 * @returns {{value: string, about: string}[]|null}
 */
export function choices(schema, root) {
  if (schema.enum) return schema.enum.map((/** @type {string} */ value) => ({ value, about: "" }));
  const kinds = schema.oneOf ?? schema.anyOf;
  if (!kinds) return null;
  const found = [];
  for (const kind of kinds) {
    const own = resolved(kind, root);
    if (typeof own.const === "string") found.push({ value: own.const, about: own.description ?? "" });
    else if (own.oneOf || own.enum) found.push(...choices(own, root) ?? []);
    else return null;
  }
  return found.length ? found : null;
}

/**
 * The schema of an op of that name.
 * @param {Schema} root
 * @param {string} name
 * @returns {Schema|undefined}
 */
export function schemaOfOp(root, name) {
  return root.$defs.Op.oneOf.find((/** @type {Schema} */ kind) => kind.properties.op.const === name);
}

/** @param {Schema} root */
export function opNames(root) {
  return root.$defs.Op.oneOf.map((/** @type {Schema} */ kind) => kind.properties.op.const);
}

/**
 * The number among several kinds, such as that of an alpha; nothing where none is one.
 * @param {Schema} schema
 * @param {Schema} root
 * @returns {Schema|undefined}
 */
export function numberAmong(schema, root) {
  return schema.anyOf?.map((/** @type {Schema} */ kind) => resolved(kind, root)).find((/** @type {Schema} */ kind) => kind.type === "number" || kind.type === "integer");
}
