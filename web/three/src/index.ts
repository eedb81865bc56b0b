export { WIRE_VERSION } from '@lumencast/client';
