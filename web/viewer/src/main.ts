import { WIRE_VERSION } from '@lumencast/three';

document.title = `Lumencast, wire version ${WIRE_VERSION}`;
