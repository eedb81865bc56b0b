/** The worker that decodes pictures of lightmaps, apart from the page that draws them. */
import { RegionDecoder } from './region-decoder.js';
import { DecoderService, type Question } from './service.js';

/** What a worker has of its global scope; the types are those of a page. */
interface WorkerScope {
  postMessage(message: unknown, transfer: Transferable[]): void;
  onmessage: ((event: MessageEvent<Question>) => void) | null;
}

const scope = globalThis as unknown as WorkerScope;
const service = new DecoderService(
  (format) => new RegionDecoder(format),
  (answer, buffers) => scope.postMessage(answer, buffers),
);
scope.onmessage = ({ data }) => service.take(data);
