// Load test of a real server: node tests/bench/load.mjs BIN_FOLDER [STREAMS [SOAK_SECONDS]]
// Starts its own servers on free ports with temporary folders. Prints figures and exits with 1 when a bound is missed.
import { spawn, execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync } from "node:fs";
import http from "node:http";
import os from "node:os";
import path from "node:path";
import { setTimeout as pause } from "node:timers/promises";

const [bin, streamCount = "1000", soakSeconds = "30"] = process.argv.slice(2);
const holds = bin === "--hold";
const folder = holds ? "" : mkdtempSync(path.join(os.tmpdir(), "creased-load-"));
const missed = [];

function bound(holds, text) {
  console.log(`${holds ? "ok    " : "MISSED"} ${text}`);
  if (!holds) missed.push(text);
}

class Server {
  static count = 0;

  static async start(...flags) {
    const server = new Server();
    const name = path.join(folder, `server${Server.count++}`);
    server.process = spawn(
      path.join(bin, "creased"),
      ["serve", "--port", "0", "--port-file", `${name}.port`, "--data-dir", name, "--log-level", "error", ...flags],
      { stdio: ["ignore", "ignore", "inherit"] },
    );
    while (true) {
      try {
        server.port = Number(readFileSync(`${name}.port`, "utf8"));
        return server;
      } catch {
        if (server.process.exitCode !== null) throw new Error("the server does not start");
        await pause(20);
      }
    }
  }

  request(method, target, { body, headers = {}, agent } = {}) {
    return new Promise((resolve, reject) => {
      const request = http.request({ port: this.port, method, path: target, headers, agent }, resolve);
      request.on("error", reject);
      request.end(body);
    });
  }

  async call(method, target, options) {
    const response = await this.request(method, target, options);
    const pieces = [];
    for await (const piece of response) pieces.push(piece);
    return { status: response.statusCode, headers: response.headers, text: Buffer.concat(pieces).toString() };
  }

  submit(seed, query, options = {}) {
    const headers = { "content-type": "model/obj", ...options.headers };
    return this.call("POST", `/v1/jobs?seed=${seed}&${query}`, { body: options.body ?? cube(2), ...options, headers });
  }

  /// Memory, threads and descriptors of the server process, including its bounded pool of idle threads.
  held() {
    const status = readFileSync(`/proc/${this.process.pid}/status`, "utf8");
    const number = (name) => Number(new RegExp(`${name}:\\s+(\\d+)`).exec(status)[1]);
    return {
      memory_mb: number("VmRSS") / 1024,
      threads: number("Threads"),
      descriptors: readdirSync(`/proc/${this.process.pid}/fd`).length,
    };
  }

  async stop() {
    const ended = new Promise((resolve) => this.process.on("exit", resolve));
    this.process.kill("SIGTERM");
    await ended;
  }
}

/// A closed cube with n by n squares on a side, as OBJ.
function cube(n) {
  const lines = [];
  let count = 0;
  for (const [u, v, w] of [[0, 1, 2], [1, 2, 0], [2, 0, 1]]) {
    for (const side of [0, 1]) {
      for (let i = 0; i < n; ++i) {
        for (let j = 0; j < n; ++j) {
          const corners = side ? [[0, 0], [1, 0], [1, 1], [0, 1]] : [[0, 0], [0, 1], [1, 1], [1, 0]];
          for (const [a, b] of corners) {
            const point = [];
            point[u] = (i + a) / n;
            point[v] = (j + b) / n;
            point[w] = side;
            lines.push(`v ${point.join(" ")}`);
          }
          lines.push(`f ${count + 1} ${count + 2} ${count + 3} ${count + 4}`);
          count += 4;
        }
      }
    }
  }
  return lines.join("\n") + "\n";
}

const percentile = (values, part) => values.sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(values.length * part))];

/// Runs `work(i)` for all i below `count`, up to `width` at a time.
async function inParallel(count, width, work) {
  let next = 0;
  const worker = async () => {
    while (next < count) await work(next++);
  };
  await Promise.all(Array.from({ length: width }, worker));
}

async function until(condition, seconds) {
  const end = Date.now() + seconds * 1000;
  while (!(await condition())) {
    if (Date.now() > end) throw new Error("waited too long");
    await pause(20);
  }
}

/// Holds the streams open. Runs in its own process, so that their events do not delay the calls that are measured.
async function holdStreams(port, id, count) {
  const agent = new http.Agent({ keepAlive: false, maxSockets: Infinity });
  const server = Object.assign(new Server(), { port });
  let heard = 0;
  await inParallel(count, 50, async () => {
    const stream = await server.request("GET", `/v1/jobs/${id}/events`, { agent });
    if (stream.statusCode !== 200) throw new Error(`a stream was answered ${stream.statusCode}`);
    stream.once("data", () => ++heard);
    stream.resume();
  });
  await until(() => heard === count, 60);
  console.log("open");
}

async function streams(count) {
  const server = await Server.start("--workers", "1", "--max-streams", `${count + 50}`, "--max-connections",
    `${count + 200}`);
  const job = JSON.parse((await server.submit(1, "sweeps=100000", { body: cube(40) })).text);
  const holder = spawn(process.execPath, [process.argv[1], "--hold", server.port, job.id, count],
    { stdio: ["ignore", "pipe", "inherit"] });
  await new Promise((resolve, reject) => {
    holder.stdout.once("data", resolve);
    holder.once("exit", () => reject(new Error("the streams were not opened")));
  });
  const targets = [`/v1/jobs/${job.id}`, "/v1/jobs?limit=20", "/v1/parameters", "/healthz"];
  const keep = new http.Agent({ keepAlive: true, maxSockets: 4 });
  const times = [];
  await inParallel(2000, 4, async (i) => {
    const start = performance.now();
    const { status } = await server.call("GET", targets[i % targets.length], { agent: keep });
    if (status !== 200) throw new Error(`a call was answered ${status}`);
    times.push(performance.now() - start);
    await pause(5);
  });
  const p50 = percentile(times, 0.5), p99 = percentile(times, 0.99);
  const { memory_mb, threads } = server.held();
  console.log(`       ${count} streams open: calls p50 ${p50.toFixed(1)} ms, p99 ${p99.toFixed(1)} ms; ` +
    `${memory_mb.toFixed(0)} MB, ${threads} threads`);
  bound(p99 < 50, `p99 of other calls under 50 ms with ${count} event streams`);
  holder.removeAllListeners("exit").kill();
  keep.destroy();
  await server.stop();
}

async function smallJobs(count) {
  const server = await Server.start("--max-connections", "64", "--max-streams", "8", "--workers", `${os.cpus().length}`);
  const agent = new http.Agent({ keepAlive: true, maxSockets: 8 });
  const start = performance.now();
  await inParallel(count, 8, async (i) => {
    const { status, text } = await server.submit(i, "sweeps=1&threads=1", { agent });
    if (status !== 202) throw new Error(`a job was answered ${status}: ${text}`);
  });
  const submitted = (performance.now() - start) / 1000;
  const left = async (state) => JSON.parse((await server.call("GET", `/v1/jobs?state=${state}&limit=1`, { agent })).text).jobs.length;
  await until(async () => (await left("queued")) + (await left("running")) === 0, 300);
  const ended = (performance.now() - start) / 1000;
  let succeeded = 0, cursor = "";
  do {
    const page = JSON.parse((await server.call("GET", `/v1/jobs?state=succeeded&limit=1000${cursor}`, { agent })).text);
    succeeded += page.jobs.length;
    cursor = page.next_cursor ? `&cursor=${page.next_cursor}` : "";
  } while (cursor);
  console.log(`       ${count} jobs of 48 faces: ${(count / submitted).toFixed(0)}/s taken, ${(count / ended).toFixed(0)}/s from submission to result`);
  bound(succeeded === count, `all ${count} small jobs succeeded`);
  agent.destroy();
  await server.stop();
}

async function soak(seconds) {
  const server = await Server.start("--max-connections", "64", "--max-streams", "32", "--workers", "1");
  const agent = new http.Agent({ keepAlive: true, maxSockets: 8 });
  const end = Date.now() + seconds * 1000, samples = [];
  let calls = 0;
  const wrong = new Map();
  const round = async (seed) => {
    const submitted = await server.submit(seed, "sweeps=1", { agent });
    const job = submitted.headers.location;
    const expect = ({ status, text }, wanted) => {
      ++calls;
      if (status !== wanted) wrong.set(`${status} for ${wanted}: ${text.slice(0, 160)}`, 1);
    };
    expect(submitted, 202);
    if (!job) return;
    expect(await server.call("GET", `${job}/events`, { agent }), 200);
    expect(await server.call("GET", `${job}/mesh?format=obj`, { agent }), 200);
    expect(await server.call("GET", `${job}/labels`, { agent }), 200);
    expect(await server.call("GET", `${job}/mesh?format=nonsense`, { agent }), 400);
    expect(await server.call("DELETE", job, { agent }), 204);
  };
  const sampler = (async () => {
    while (Date.now() < end) {
      await pause(500);
      samples.push(server.held());
    }
  })();
  let seed = 0;
  await Promise.all([...Array.from({ length: 8 }, async () => { while (Date.now() < end) await round(seed++); }), sampler]);
  for (const answer of [...wrong.keys()].slice(0, 5)) console.log(`       ${answer}`);
  bound(wrong.size === 0, `soak: every call was answered as it should be`);
  const third = Math.floor(samples.length / 3);
  const most = (part, name) => Math.max(...part.map((sample) => sample[name]));
  for (const [name, slack] of [["memory_mb", 16], ["threads", 2], ["descriptors", 16]]) {
    const middle = most(samples.slice(third, 2 * third), name), late = most(samples.slice(2 * third), name);
    bound(late <= middle + slack, `soak of ${seconds} s, ${calls} calls: ${name} ${middle.toFixed(0)} then ${late.toFixed(0)}`);
  }
  agent.destroy();
  await server.stop();
}

async function overload() {
  const server = await Server.start("--max-connections", "40", "--max-streams", "8", "--workers", "0", "--max-queued",
    "100", "--trusted-proxy", "127.0.0.1", "--address-rate", "20", "--address-burst", "50");
  const answers = new Map();
  let broken = 0;
  await inParallel(3000, 120, async (i) => {
    const headers = { "x-forwarded-for": `203.0.113.${i % 4}` };
    try {
      const { status, headers: of } = await server.submit(i, "sweeps=1", { headers, agent: false });
      answers.set(status, (answers.get(status) ?? 0) + 1);
      if ((status === 429 || status === 503) && !of["retry-after"]) throw new Error("no Retry-After");
    } catch (error) {
      if (error.message === "no Retry-After") throw error;
      ++broken;
    }
  });
  console.log(`       overload: ${[...answers].sort().map(([status, n]) => `${status}: ${n}`).join(", ")}, connections lost: ${broken}`);
  bound([...answers.keys()].every((status) => [202, 429, 503].includes(status)), "overload is answered 202, 429 or 503 only");
  bound(broken === 0, "and no connection is lost without an answer");
  const list = JSON.parse((await server.call("GET", "/v1/jobs?limit=1000")).text).jobs;
  bound(list.length === answers.get(202), "every job that was taken is there");
  bound((await server.call("GET", "/readyz")).status === 200, "and the server is ready for more");
  await server.stop();
}

async function wrk() {
  const server = await Server.start("--max-connections", "200", "--max-streams", "8", "--workers", "0");
  const job = JSON.parse((await server.submit(1, "sweeps=1")).text);
  for (const target of ["/healthz", `/v1/jobs/${job.id}`]) {
    const report = execFileSync("wrk", ["-t2", "-c64", "-d4s", "--latency", `http://127.0.0.1:${server.port}${target}`]).toString();
    const rate = /Requests\/sec:\s+([\d.]+)/.exec(report)[1], p99 = /99%\s+(\S+)/.exec(report)[1];
    console.log(`       wrk on ${target.replace(job.id, "{id}")}: ${rate} calls/s, p99 ${p99}`);
    bound(!/Non-2xx|Socket errors/.test(report), `every call of wrk on ${target.replace(job.id, "{id}")} was answered 200`);
  }
  await server.stop();
}

try {
  if (holds) {
    await holdStreams(...process.argv.slice(3).map((word, i) => (i === 1 ? word : Number(word))));
    await new Promise(() => setInterval(() => {}, 60_000)); // until the parent ends it
  }
  await streams(Number(streamCount));
  await smallJobs(1000);
  await overload();
  await wrk();
  await soak(Number(soakSeconds));
} finally {
  if (folder) rmSync(folder, { recursive: true, force: true });
}
process.exit(missed.length > 0 ? 1 : 0);
