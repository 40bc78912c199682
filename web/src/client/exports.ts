/** What is the same in browsers and in Node. */
export { Client, type ConnectOptions, type Events, type Modules } from './client.js';
export { CoreError } from './failure.js';
export { Latest } from './latest.js';
export { type RequestOptions, type Transport } from './link.js';
export { Player, type PlayOptions } from './player.js';
export type * from './protocol.js';
