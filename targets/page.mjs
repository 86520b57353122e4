// Opens the page of a folder in a browser without a screen, waits until it has shown pictures, and checks what it says.
//
// page.mjs FOLDER BROWSER SHOT
import { spawn } from 'node:child_process';
import { createServer } from 'node:http';
import { readFile, stat } from 'node:fs/promises';
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
const address = `http://127.0.0.1:${server.address().port}/`;

// What the browser prints to its standard output.
function run(...options) {
  return new Promise((done, failed) => {
    const flags = ['--headless', '--no-sandbox', '--disable-gpu', '--virtual-time-budget=4000', ...options, address];
    const child = spawn(browser, flags, { stdio: ['ignore', 'pipe', 'ignore'], timeout: 60000 });
    let text = '';
    child.stdout.on('data', (more) => (text += more));
    child.on('error', failed);
    child.on('close', () => done(text));
  });
}

const page = await run('--dump-dom');
const said = [...page.matchAll(/<output[^>]*>([^<]*)<\/output>/g)].map((match) => match[1]);
console.log(said.join('; '));
await run(`--screenshot=${shot}`, '--window-size=900,900');
server.close();
const size = (await stat(shot)).size;
if (!/triangles built/.test(said[0]) || !/million pixels/.test(said[1]) || size < 20000) {
  console.error(`the page does not show a picture: ${size} bytes of it`);
  process.exit(1);
}
