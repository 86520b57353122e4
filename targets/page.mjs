// Opens the page of a folder in a browser without a screen, switches between its structures, and checks what it says and shows.
//
// page.mjs FOLDER BROWSER MESH SHOT
import { spawn } from 'node:child_process';
import { createServer } from 'node:http';
import { readFile, writeFile } from 'node:fs/promises';
import { join, extname, resolve } from 'node:path';

const [folder, browser, mesh, shot] = process.argv.slice(2);
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };

const fetched = new Set();
const server = createServer(async ({ url }, response) => {
  fetched.add(url);
  try {
    const path = url === '/' ? '/index.html' : url;
    const body = await readFile(join(folder, path));
    response.writeHead(200, { 'Content-Type': types[extname(path)] ?? 'text/plain' }).end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));

// The browser listens on its third pipe and answers on the fourth: JSON, each message ended by a zero.
const flags = ['--headless', '--no-sandbox', '--disable-gpu', '--remote-debugging-pipe', '--window-size=900,900'];
const child = spawn(browser, flags, { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
const waiting = new Map();
let count = 0, rest = '', session;
child.stdio[4].on('data', (more) => {
  const messages = (rest + more).split('\0');
  rest = messages.pop();
  for (const message of messages.map((text) => JSON.parse(text))) {
    waiting.get(message.id)?.(message.result ?? fail(message.error.message));
  }
});
const limit = setTimeout(() => fail('the browser does not answer'), 90000);

function ask(method, params = {}) {
  const id = ++count;
  child.stdio[3].write(JSON.stringify({ id, method, params, sessionId: session }) + '\0');
  return new Promise((done) => waiting.set(id, done));
}

function fail(why) {
  console.error(`the page: ${why}`);
  child.kill();
  process.exit(1);
}

const evaluate = async (expression) => (await ask('Runtime.evaluate', { expression })).result.value;
const wait = (ms) => new Promise((done) => setTimeout(done, ms));

// What the page says once it has shown pictures of a structure over a scene, as `how` tells: what it is, and at what speed it is traced.
async function said(structure, how) {
  let text;
  for (let i = 0; i < 200; i++) {
    text = await evaluate(`[...document.querySelectorAll('output')].map((o) => o.value).join('; ')`);
    const parts = /^([\d,]+) triangles, (.+) of \d+ KiB, (.+); ([\d.]+) million pixels a second, ([\d.]+) steps each$/.exec(text);
    const [, triangles, name, source, speed, steps] = parts ?? [];
    if (name === structure && how.test(`${triangles} ${source}`) && Number(speed) > 0 && Number(steps) > 0) return text;
    await wait(100);
  }
  fail(`it shows no picture: ${text}`);
}

const { targetId } = await ask('Target.createTarget', { url: `http://127.0.0.1:${server.address().port}/` });
({ sessionId: session } = await ask('Target.attachToTarget', { targetId, flatten: true }));
const click = (what) => evaluate(`document.querySelector('${what}').click()`);
const picture = () => evaluate(`document.getElementById('picture').toDataURL()`);

// Standing still, all structures show the same picture: that of the first one.
async function samePictures(how) {
  const pictures = [];
  for (const [structure, name] of [['nested', 'nested grids'], ['grid', 'one grid'], ['bvh', 'BVH']]) {
    await click(`[name=structure][value="${structure}"]`);
    console.log(await said(name, how));
    pictures.push(await picture());
  }
  if (pictures[0].length < 10000 || pictures.some((one) => one !== pictures[0])) fail('pictures differ, or are empty');
  return pictures[0];
}

await said('BVH', /^4,802 baked$/);
await click('#turn');
await wait(200);
const first = await samePictures(/^4,802 baked$/);
if (fetched.has('/build.wasm')) fail('it fetches a builder for what is baked');
await click('#heat');
await wait(500);
if ((await picture()) === first) fail('the heat map shows nothing else');
await writeFile(shot, Buffer.from((await ask('Page.captureScreenshot')).data, 'base64'));
await click('#heat');

// What is not baked is built: a finer scene, and a mesh of one's own.
await evaluate(`scene.value = '600x24', scene.dispatchEvent(new Event('change'))`);
const finer = await samePictures(/^28,802 built in \d+ ms$/);
if (finer === first) fail('it shows the same scene');
const { root } = await ask('DOM.getDocument');
const { nodeId } = await ask('DOM.querySelector', { nodeId: root.nodeId, selector: '#file' });
await ask('DOM.setFileInputFiles', { nodeId, files: [resolve(mesh)] });
if ((await samePictures(/^604 built in \d+ ms$/)) === finer) fail('it does not show the mesh');
clearTimeout(limit);
child.kill();
server.close();
