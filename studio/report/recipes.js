// What is on the screen as a request, a command and a program, for who does it again elsewhere.

/**
 * @typedef {{origin: string, source: {id: string, file_name: string}, target: {id: string, file_name: string}, config: Record<string, any>, ending: string, mediaType: string}} Recipe
 */

/** @param {string} text */
export function quoted(text) {
  return `'${text.replaceAll("'", "'\\''")}'`;
}

/** @param {Recipe} recipe */
export function curl({ origin, source, target, config, ending, mediaType }) {
  const body = JSON.stringify({ source: { asset: source.id }, target: { asset: target.id }, config });
  return [
    `curl --fail-with-body ${origin}/v1/retarget \\`,
    `  -H 'content-type: application/json' -H 'accept: ${mediaType}' \\`,
    `  -d ${quoted(body)} \\`,
    `  -o result.${ending}`,
  ].join("\n");
}

/** @param {Recipe} recipe */
export function commandLine({ source, target, config, ending }) {
  return [
    `cat >config.json <<'EOF'`, JSON.stringify(config, null, 2), "EOF",
    `retargetd retarget --source ${quoted(source.file_name)} --target ${quoted(target.file_name)} --config config.json --output result.${ending}`,
  ].join("\n");
}

/** @param {Recipe} recipe */
export function python({ origin, source, target, config, ending, mediaType }) {
  return [
    "import json",
    "from urllib.request import Request, urlopen",
    "",
    `config = json.loads(${JSON.stringify(JSON.stringify(config))})`,
    `body = {"source": {"asset": ${JSON.stringify(source.id)}}, "target": {"asset": ${JSON.stringify(target.id)}}, "config": config}`,
    `headers = {"content-type": "application/json", "accept": ${JSON.stringify(mediaType)}}`,
    `request = Request(${JSON.stringify(`${origin}/v1/retarget`)}, json.dumps(body).encode(), headers)`,
    "with urlopen(request) as answer:",
    `    open("result.${ending}", "wb").write(answer.read())`,
    `    print(answer.headers["verdict"], answer.headers["verdict-reason"])`,
  ].join("\n");
}
