// engine.wasm for Python in the worker: an instance for each world, and its memory as bytes. What a world does is in
// Python and in the module; see src/motorcade/browser/kernels.py.

const PAGE_BYTES = 1 << 16;
const SECTION = "motorcade.arguments";

/** An instance of engine.wasm, as `motorcade.browser.kernels.Instance` describes it. */
export class EngineInstance {
  /** The address from which on the memory is free. */
  readonly heap: number;
  private readonly memory: WebAssembly.Memory;
  private readonly kernels: Record<string, (address: number) => number>;
  // A memory that grows gets a new buffer, so all of its bytes are shown anew then.
  private bytes: Uint8Array;

  constructor(
    module: WebAssembly.Module,
    /** The text of the module's section `motorcade.arguments`. */
    readonly section: string,
  ) {
    const { exports } = new WebAssembly.Instance(module);
    this.kernels = exports as Record<string, (address: number) => number>;
    this.memory = exports.memory as WebAssembly.Memory;
    this.heap = (exports.__heap_base as WebAssembly.Global).value as number;
    this.bytes = new Uint8Array(this.memory.buffer);
  }

  /** Makes the memory at least `end` bytes large; returns whether that was possible. */
  grow(end: number): boolean {
    const missing = end - this.memory.buffer.byteLength;
    if (missing > 0) {
      try {
        this.memory.grow(Math.ceil(missing / PAGE_BYTES));
      } catch {
        return false;
      }
      this.bytes = new Uint8Array(this.memory.buffer);
    }
    return true;
  }

  /** A part of the memory, without a copy; it is valid until the memory grows. */
  view(address: number, size: number): Uint8Array {
    return this.bytes.subarray(address, address + size);
  }

  clear(address: number, size: number): void {
    this.bytes.fill(0, address, address + size);
  }

  copy(to: number, address: number, size: number): void {
    this.bytes.copyWithin(to, address, address + size);
  }

  call(kernel: string, address: number): void {
    this.kernels[kernel]!(address);
  }
}

/** The compiled module, of which each world takes an instance of its own. */
export class Engine {
  private readonly section: string;

  constructor(private readonly module: WebAssembly.Module) {
    const [section] = WebAssembly.Module.customSections(module, SECTION);
    if (!section) throw new Error(`engine.wasm has no section ${SECTION}`);
    this.section = new TextDecoder().decode(section);
  }

  instance(): EngineInstance {
    return new EngineInstance(this.module, this.section);
  }
}

/** Loads and compiles engine.wasm. */
export async function openEngine(url: string): Promise<Engine> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`engine.wasm: ${response.status}`);
  return new Engine(await WebAssembly.compile(await response.arrayBuffer()));
}
