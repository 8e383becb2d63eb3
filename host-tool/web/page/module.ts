// One WebAssembly module with the C interface of the crate flexor-web.

interface Exports {
  memory: WebAssembly.Memory;
  flexor_room(length: number): number;
  flexor_call(): number;
  flexor_answer(): number;
  flexor_panic(): number;
}

export class Module {
  private constructor(private readonly exports: Exports) {}

  static async create(bytes: BufferSource): Promise<Module> {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Module(instance.exports as unknown as Exports);
  }

  // Carries out a request. Throws the error that the module answers with, as JSON text.
  call(request: object): Uint8Array {
    const text = new TextEncoder().encode(JSON.stringify(request));
    const room = this.exports.flexor_room(text.length);
    if (room === 0) {
      throw failure(`the request is too long (${text.length} bytes)`);
    }
    new Uint8Array(this.exports.memory.buffer, room, text.length).set(text);
    let length: number;
    try {
      length = this.exports.flexor_call();
    } catch (error) {
      const message = this.text(this.exports.flexor_panic());
      throw failure(`the simulator stopped; reload the page. ${message || String(error)}`);
    }
    const answer = this.bytes(Math.abs(length));
    if (length < 0) {
      throw JSON.parse(new TextDecoder().decode(answer));
    }
    return answer;
  }

  json(request: object): unknown {
    return JSON.parse(new TextDecoder().decode(this.call(request)));
  }

  get memory(): number {
    return this.exports.memory.buffer.byteLength;
  }

  private bytes(length: number): Uint8Array {
    return new Uint8Array(this.exports.memory.buffer, this.exports.flexor_answer(), length).slice();
  }

  private text(length: number): string {
    return new TextDecoder().decode(this.bytes(length));
  }
}

function failure(message: string): { message: string } {
  return { message };
}
