// Opens the page of a folder in a browser without a screen, switches between its structures, and checks what it says and shows.
//
// page.mjs FOLDER BROWSER SHOT
import { spawn } from 'node:child_process';
import { createServer } from 'node:http';
import { readFile, writeFile } from 'node:fs/promises';
import { join, extname } from 'node:path';

const [folder, browser, shot] = process.argv.slice(2);
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };

const server = createServer(async ({ url }, response) => {
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

// What the page says once it has shown pictures: what was built, and at what speed it is traced.
async function said() {
  for (let i = 0; i < 200; i++) {
    const text = await evaluate(`[...document.querySelectorAll('output')].map((o) => o.value).join('; ')`);
    const parts = /^([\d,]+) triangles built in \d+ ms, \d+ KiB; ([\d.]+) million pixels a second, ([\d.]+) steps each$/.exec(text);
    if (parts && parts.slice(2).every((number) => Number(number) > 0)) return text;
    await wait(100);
  }
  fail('it shows no picture');
}

const { targetId } = await ask('Target.createTarget', { url: `http://127.0.0.1:${server.address().port}/` });
({ sessionId: session } = await ask('Target.attachToTarget', { targetId, flatten: true }));
const click = (what) => evaluate(`document.querySelector('${what}').click()`);
const picture = () => evaluate(`document.getElementById('picture').toDataURL()`);
// Standing still, all structures show the same picture.
await said();
await click('#turn');
await wait(200);
const pictures = [];
for (const structure of [1, 2, 0]) {
  await click(`[name=structure][value="${structure}"]`);
  await wait(300);
  console.log(`${structure}: ${await said()}`);
  pictures.push(await picture());
}
if (pictures[0].length < 10000 || pictures.some((one) => one !== pictures[0])) fail('pictures differ, or are empty');
await click('#heat');
await wait(500);
if ((await picture()) === pictures[0]) fail('the heat map shows nothing else');
await writeFile(shot, Buffer.from((await ask('Page.captureScreenshot')).data, 'base64'));
clearTimeout(limit);
child.kill();
server.close();
