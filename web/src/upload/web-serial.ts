/** The browser's own serial ports, where it has them. */

export interface SerialPort {
  open(options: { baudRate: number }): Promise<void>;
  close(): Promise<void>;
  readonly readable: ReadableStream<Uint8Array<ArrayBuffer>>;
  readonly writable: WritableStream<Uint8Array>;
}

interface Serial {
  requestPort(): Promise<SerialPort>;
}

function serial(): Serial | undefined {
  return (navigator as Navigator & { serial?: Serial }).serial;
}

export const hasWebSerial = (): boolean => serial() !== undefined;

/** The port that the user points at; null where they change their mind. */
export async function requestPort(): Promise<SerialPort | null> {
  return (await serial()?.requestPort().catch(() => null)) ?? null;
}

/** Hands on what the port says, and writes what it is given, in its order. */
export function carryBytes(port: SerialPort, onBytes: (bytes: Uint8Array<ArrayBuffer>) => void) {
  const reader = port.readable.getReader();
  const writer = port.writable.getWriter();
  const reading = (async () => {
    for (let next = await reader.read(); !next.done; next = await reader.read()) onBytes(next.value);
  })().catch(() => undefined);
  return {
    write: (bytes: ArrayBuffer) => void writer.write(new Uint8Array(bytes)).catch(() => undefined),
    close: async () => {
      await reader.cancel().catch(() => undefined);
      await reading;
      reader.releaseLock();
      await writer.close().catch(() => undefined);
      await port.close().catch(() => undefined);
    },
  };
}
