// The robot in three dimensions: frame, cables coloured by tension, platform, box of targets, target.
import {
  BoxGeometry, BufferGeometry, CanvasTexture, Color, CylinderGeometry, DoubleSide, EdgesGeometry, GridHelper, Group,
  HemisphereLight, DirectionalLight, LineBasicMaterial, LineDashedMaterial, LineLoop, LineSegments, Mesh,
  MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Quaternion, Scene, SphereGeometry, Sprite, SpriteMaterial, SRGBColorSpace, Vector3,
  WebGLRenderer, WireframeGeometry, Box3,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { TransformControls } from "three/addons/controls/TransformControls.js";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import type { Border, Cycle, Description, Platform } from "./daemon";

const LOW = new Color("#3d8bd4"), MIDDLE = new Color("#3fae6b"), HIGH = new Color("#d64545"), SLACK = new Color("#8a8f98");
/** Opacity of the platform, if its pose is known and if not. */
const SURE = 0.9, UNSURE = 0.3;
const UP = new Vector3(0, 1, 0);
const LOOK_MS = 4, SLOW_MS = 25, SHARE = 4;
/** Smaller changes of a pose or a tension are not drawn. */
const VISIBLE_M = 2e-4, VISIBLE_N = 2;
const UNKNOWN = 1e9;
const SMALLEST_BODY_M = 0.04;

/** A point of the robot's file as a vector; in a plane the third coordinate is 0. */
const at = (point: number[]): Vector3 => new Vector3(point[0] ?? 0, point[1] ?? 0, point[2] ?? 0);

/** Return a colour from slack over low and middle to high tension. */
export function tensionColour(tension: number | null, low: number | null, high: number | null): Color {
  if (tension === null || low === null || high === null || tension < low / 4) return SLACK.clone();
  const share = Math.min(Math.max((tension - low) / (high - low), 0), 1);
  return share < 0.5 ? LOW.clone().lerp(MIDDLE, 2 * share) : MIDDLE.clone().lerp(HIGH, 2 * share - 1);
}

function bodyOf(platform: Platform): { centre: Vector3; size: Vector3 } {
  const box = platform.body
    ? new Box3(at(platform.body.min_m), at(platform.body.max_m))
    : new Box3().setFromPoints(platform.anchor_points_m.map(at));
  const size = box.getSize(new Vector3());
  size.set(...(size.toArray().map((one) => Math.max(one, SMALLEST_BODY_M)) as [number, number, number]));
  return { centre: box.getCenter(new Vector3()), size };
}

function outline(size: Vector3, centre: Vector3, material: LineBasicMaterial): LineSegments {
  const lines = new LineSegments(new EdgesGeometry(new BoxGeometry(size.x, size.y, size.z)), material);
  lines.position.copy(centre);
  return lines;
}

/** Return a number on a disc that faces the viewer. */
function label(text: string, place: Vector3, size: number): Sprite {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const pen = canvas.getContext("2d")!;
  pen.fillStyle = "#1f4f80";
  pen.arc(32, 32, 30, 0, 2 * Math.PI);
  pen.fill();
  pen.fillStyle = "#ffffff";
  pen.font = "600 38px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 32, 34);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  const sprite = new Sprite(new SpriteMaterial({ map, depthTest: false }));
  sprite.position.copy(place);
  sprite.scale.setScalar(size);
  sprite.renderOrder = 1;
  return sprite;
}

/** Called with the pose of the outline while it is dragged. */
type Dragged = (position_m: number[], rotation_rad: number[]) => void;

export class RobotScene {
  #renderer: WebGLRenderer;
  #scene = new Scene();
  #camera = new PerspectiveCamera(40, 1, 0.05, 500);
  #controls: OrbitControls;
  #room = new Group();
  #platform = new Group();
  #ghost = new Group();
  #handles: TransformControls;
  #dragged: Dragged | null = null;
  #path = new Group();
  #border = new Group();
  #part: Line2 | null = null;
  #share = 0;
  #cables: Mesh<CylinderGeometry, MeshBasicMaterial>[] = [];
  #exits: Vector3[] = [];
  #description: Description | null = null;
  #block = new MeshStandardMaterial({ color: "#ffb454", transparent: true, opacity: UNSURE, roughness: 0.6 });
  /** Whether exit points and anchor points have the numbers of their cables. */
  numbered = false;
  #asked = false;
  #again = false;
  #shown: number[] = [];
  #observer: ResizeObserver;

  /** Throws if the browser offers no WebGL. */
  constructor(private readonly host: HTMLElement) {
    this.#renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    host.append(this.#renderer.domElement);
    this.#controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#controls.addEventListener("change", () => this.#draw());
    this.#handles = new TransformControls(this.#camera, this.#renderer.domElement);
    this.#handles.addEventListener("change", () => this.#draw());
    this.#handles.addEventListener("dragging-changed", ({ value }) => (this.#controls.enabled = !value));
    this.#handles.addEventListener("objectChange", () => this.#drag());
    const sun = new DirectionalLight("#ffffff", 1.6);
    sun.position.set(3, 8, 5);
    this.#scene.add(new HemisphereLight("#ffffff", "#7788aa", 1.6), sun, this.#room, this.#handles.getHelper());
    this.#observer = new ResizeObserver(() => this.#resize());
    this.#observer.observe(host);
    this.#resize();
  }

  close(): void {
    this.#observer.disconnect();
    this.#handles.dispose();
    this.#controls.dispose();
    this.#renderer.dispose();
    this.#renderer.domElement.remove();
  }

  /** Build the scene of a robot; z of a spatial robot points up, and y of a planar one. */
  describe(description: Description): void {
    this.#description = description;
    this.#shown = [];
    this.#room.clear();
    this.#platform.clear();
    this.#ghost.clear();
    const platform = description.platform;
    if (!platform) return;
    const planar = platform.workspace_min_m.length === 2;
    this.#room.rotation.x = planar ? 0 : -Math.PI / 2;
    const exits = platform.exit_points_m.map(at);
    const points = new BufferGeometry().setFromPoints(exits);
    if (this.numbered) this.#addNumbers(exits, platform.anchor_points_m.map(at));
    this.#room.add(new Points(points, new PointsMaterial({ color: "#7a8797", size: 9, sizeAttenuation: false })));
    this.#addTargets(platform);
    this.#addPlatform(platform);
    this.#exits = exits;
    const radius = new Box3().setFromPoints(exits).getSize(new Vector3()).length() / 450;
    this.#cables = exits.map(() => new Mesh(new CylinderGeometry(radius, radius, 1, 6), new MeshBasicMaterial({ color: SLACK })));
    this.#room.add(this.#platform, this.#ghost, this.#path, this.#border, ...this.#cables);
    this.#ghost.visible = false;
    this.#place(this.#platform, at(platform.home_m), new Quaternion());
    this.#stretch(null);
    this.#addFloor(exits, planar);
    this.#look(exits, platform, planar);
  }

  /** Show a cycle: the platform's pose and the cables' tensions. */
  show(cycle: Cycle): void {
    const platform = this.#description?.platform;
    if (!platform) return;
    const seen = [...cycle.pose.map((one) => (one ?? UNKNOWN) / VISIBLE_M), ...cycle.tension_N.map((one) => (one ?? UNKNOWN) / VISIBLE_N)];
    if (seen.every((one, place) => Math.abs(one - (this.#shown[place] ?? Infinity)) < 1)) return; // noise does not cost pictures
    this.#shown = seen;
    const [x, y, z, w, qx, qy, qz] = cycle.pose;
    this.#block.opacity = x == null ? UNSURE : SURE;
    if (x != null && y != null) {
      const turned = w == null ? new Quaternion() : new Quaternion(qx ?? 0, qy ?? 0, qz ?? 0, w);
      this.#place(this.#platform, new Vector3(x, y, z ?? 0), turned);
    }
    this.#stretch(cycle);
    this.#draw();
  }

  /** Show where a move will end, or nothing. */
  aim(target_m: number[] | null, rotation_rad: number[] | null): void {
    this.#ghost.visible = target_m !== null;
    if (target_m) {
      const turn = rotation_rad?.length === 1 ? new Vector3(0, 0, rotation_rad[0]) : at(rotation_rad ?? []);
      const angle = turn.length();
      const turned = new Quaternion().setFromAxisAngle(angle ? turn.divideScalar(angle) : new Vector3(0, 0, 1), angle);
      this.#place(this.#ghost, at(target_m), turned);
    }
    this.#draw();
  }

  /** Number the ends of the cables, from 1; a number of an anchor point is smaller. */
  #addNumbers(exits: Vector3[], anchors: Vector3[]): void {
    const reach = new Box3().setFromPoints(exits).getSize(new Vector3()).length();
    exits.forEach((one, number) => this.#room.add(label(String(number + 1), one, reach / 18)));
    const beside = anchors.map((one, number) => anchors.slice(0, number).filter((other) => other.distanceTo(one) < 1e-6).length);
    anchors.forEach((one, number) => {
      const sprite = label(String(number + 1), one, reach / 30);
      sprite.center.set(0.5 - 0.8 * beside[number]!, 0.5); // numbers of cables that end in one point stand side by side
      this.#platform.add(sprite);
    });
  }

  /** Show where the cables can hold the platform, or nothing. */
  workspace(border: Border | null): void {
    this.#border.clear();
    if (border) {
      const geometry = new BufferGeometry().setFromPoints(border.points_m.map(at));
      if (border.triangles.length) geometry.setIndex(border.triangles.flat());
      const colour = { color: "#1f8a8a", transparent: true, depthWrite: false };
      this.#border.add(border.triangles.length
        ? new Mesh(geometry, new MeshBasicMaterial({ ...colour, opacity: 0.12, side: DoubleSide }))
        : new LineLoop(geometry, new LineBasicMaterial(colour)));
      if (border.triangles.length) this.#border.add(new LineSegments(new WireframeGeometry(geometry), new LineBasicMaterial({ ...colour, opacity: 0.18 })));
    }
    this.#draw();
  }

  /** Let the user drag the outline that `aim` shows, or turn it; null ends this. */
  drag(how: "move" | "turn" | null, dragged: Dragged | null = null): void {
    const platform = this.#description?.platform;
    this.#dragged = dragged;
    if (!how || !platform) {
      this.#handles.detach();
      return this.#draw();
    }
    const planar = platform.workspace_min_m.length === 2, about = how === "turn" && planar;
    this.#handles.setMode(how === "turn" ? "rotate" : "translate");
    Object.assign(this.#handles, { showX: !about, showY: !about, showZ: about || !planar, size: 0.9 });
    this.#handles.attach(this.#ghost);
    this.#draw();
  }

  #drag(): void {
    const platform = this.#description?.platform;
    if (!platform || !this.#dragged) return;
    const { position, quaternion } = this.#ghost;
    position.clamp(at(platform.workspace_min_m), at(platform.workspace_max_m));
    const half = Math.acos(Math.min(Math.abs(quaternion.w), 1)), sign = Math.sign(quaternion.w) || 1;
    const turn = new Vector3(quaternion.x, quaternion.y, quaternion.z).setLength(2 * sign * half);
    const names = platform.controlled.filter((name) => name.length > 1);
    const angles = names.length === 1 ? [turn.z] : turn.toArray().slice(0, names.length);
    this.#dragged(position.toArray().slice(0, platform.workspace_min_m.length), angles.map((one) => one || 0));
  }

  /** Show a path, and the place that the robot cannot reach; or nothing. */
  route(points_m: number[][] | null, obstacle_m: number[] | null): void {
    this.#path.clear();
    this.#part = null;
    if (points_m && points_m.length > 1) {
      const points = points_m.flatMap((one) => at(one).toArray());
      const line = (color: string, linewidth: number): Line2 =>
        new Line2(new LineGeometry().setPositions(points), new LineMaterial({ color, linewidth, depthTest: false, transparent: true }));
      this.#part = line("#1f9d57", 4);
      this.#path.add(line("#9a6fd0", 2.5), this.#part);
    }
    if (obstacle_m) {
      const size = Math.max(...this.#exits.map((one) => one.length())) / 60;
      const mark = new Mesh(new SphereGeometry(size, 16, 12), new MeshBasicMaterial({ color: HIGH, depthTest: false, transparent: true }));
      mark.position.copy(at(obstacle_m));
      this.#path.add(mark);
    }
    this.#path.children.forEach((one, number) => (one.renderOrder = 2 + number)); // over what is transparent
    this.done(this.#share);
  }

  /** Show how much of the path is done, from 0 to 1. */
  done(share: number): void {
    this.#share = share;
    if (this.#part) {
      const geometry = this.#part.geometry;
      geometry.instanceCount = Math.round(share * (geometry.attributes["instanceStart"]!.count));
      this.#part.visible = geometry.instanceCount > 0;
    }
    this.#draw();
  }

  #addTargets(platform: Platform): void {
    const box = new Box3(at(platform.workspace_min_m), at(platform.workspace_max_m));
    const material = new LineDashedMaterial({ color: "#9a6fd0", dashSize: 0.06, gapSize: 0.04 });
    const lines = outline(box.getSize(new Vector3()), box.getCenter(new Vector3()), material);
    lines.computeLineDistances();
    this.#room.add(lines);
    for (const one of platform.obstacles) {
      const block = new Box3(at(one.min_m), at(one.max_m));
      this.#room.add(outline(block.getSize(new Vector3()), block.getCenter(new Vector3()), new LineBasicMaterial({ color: "#b02f2f" })));
    }
  }

  #addPlatform(platform: Platform): void {
    const { centre, size } = bodyOf(platform);
    const block = new Mesh(
      new BoxGeometry(size.x, size.y, size.z),
      this.#block,
    );
    block.position.copy(centre);
    this.#platform.add(block, outline(size, centre, new LineBasicMaterial({ color: "#8a5a10" })));
    const knot = new SphereGeometry(Math.max(size.length() / 60, 0.006), 12, 8);
    for (const anchor of platform.anchor_points_m) {
      const mesh = new Mesh(knot, new MeshStandardMaterial({ color: "#444c57" }));
      mesh.position.copy(at(anchor));
      this.#platform.add(mesh);
    }
    this.#ghost.add(outline(size, centre, new LineBasicMaterial({ color: "#9a6fd0" })));
  }

  #addFloor(exits: Vector3[], planar: boolean): void {
    this.#scene.children.filter((one) => one instanceof GridHelper).forEach((one) => this.#scene.remove(one));
    const box = new Box3().setFromPoints(exits);
    const size = box.getSize(new Vector3());
    const side = 1.2 * Math.max(size.x, planar ? size.x / 2 : size.y);
    const floor = new GridHelper(side, Math.round(side * 2), "#8894a3", "#8894a3");
    const centre = box.getCenter(new Vector3());
    const down = planar ? box.min.y : Math.min(box.min.z, 0);
    floor.position.set(centre.x, down, planar ? 0 : -centre.y);
    (floor.material as LineBasicMaterial).transparent = true;
    (floor.material as LineBasicMaterial).opacity = 0.25;
    this.#scene.add(floor);
  }

  #look(exits: Vector3[], platform: Platform, planar: boolean): void {
    this.#room.updateMatrixWorld(true);
    const box = new Box3().setFromPoints([...exits, at(platform.home_m)].map((one) => this.#room.localToWorld(one.clone())));
    const centre = box.getCenter(new Vector3());
    const reach = box.getSize(new Vector3()).length();
    const from = planar ? new Vector3(0.1, 0.08, 1) : new Vector3(0.75, 0.5, 1);
    const narrow = Math.max(1.2 / this.#camera.aspect, 1);
    this.#camera.position.copy(centre).addScaledVector(from.normalize(), narrow * reach * (planar ? 1.15 : 1.2));
    this.#controls.target.copy(centre);
    this.#controls.update();
  }

  #place(group: Group, position: Vector3, rotation: Quaternion): void {
    group.position.copy(position);
    group.quaternion.copy(rotation);
    group.updateMatrix();
  }

  #stretch(cycle: Cycle | null): void {
    const { platform, limits } = this.#description!;
    this.#cables.forEach((cable, number) => {
      const anchor = at(platform!.anchor_points_m[number]!).applyMatrix4(this.#platform.matrix);
      const along = anchor.clone().sub(this.#exits[number]!);
      cable.position.copy(anchor).add(this.#exits[number]!).divideScalar(2);
      cable.scale.y = along.length();
      cable.quaternion.setFromUnitVectors(UP, along.normalize());
      const tension = cycle?.tension_N[number] ?? null;
      const colour = tensionColour(tension, limits.tension_min_N[number] ?? null, limits.tension_max_N[number] ?? null);
      cable.material.color.copy(colour);
    });
  }

  #resize(): void {
    const { clientWidth: width, clientHeight: height } = this.host;
    if (!width || !height) return;
    this.#renderer.setSize(width, height);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#draw();
  }

  #draw(): void {
    if (this.#asked) {
      this.#again = true;
      return;
    }
    this.#asked = true;
    requestAnimationFrame(() => {
      const began = performance.now();
      this.#renderer.render(this.#scene, this.#camera);
      const gl = this.#renderer.getContext() as WebGL2RenderingContext;
      const drawn = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
      gl.flush();
      const look = (): void => { // nothing here waits for the picture: a stop must not
        const cost_ms = performance.now() - began;
        if (drawn && gl.getSyncParameter(drawn, gl.SYNC_STATUS) === gl.UNSIGNALED) return void setTimeout(look, LOOK_MS);
        gl.deleteSync(drawn);
        // without a graphics processor a picture takes long: leave most of the time to the rest of the machine
        setTimeout(() => {
          this.#asked = false;
          if (this.#again) this.#draw();
          this.#again = false;
        }, cost_ms > SLOW_MS ? SHARE * cost_ms : 0);
      };
      setTimeout(look);
    });
  }
}

/** Return the scene in `host`; null, with the reason there, if the browser cannot draw it. */
export function drawnIn(host: HTMLElement): RobotScene | null {
  try {
    return new RobotScene(host);
  } catch {
    host.classList.add("undrawn");
    host.textContent = "This browser cannot draw in three dimensions (WebGL). Everything else works.";
    return null;
  }
}
