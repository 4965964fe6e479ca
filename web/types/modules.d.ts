// Packages without types of their own.
declare module 'three';
declare module 'three/examples/jsm/controls/OrbitControls.js';

/** An object of three.js. */
type Three = any;
