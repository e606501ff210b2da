/** Points, sizes and boxes, of a drawing or of the screen. */
export interface Point {
  readonly x: number;
  readonly y: number;
}

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** A size at its left upper corner. */
export interface Box extends Point, Size {}
