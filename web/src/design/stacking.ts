import type { Size } from "../protocol/types";

/** What a picture gets at most of the height where the text is below it. */
export const kPictureAbove = 0.64;
/** So much larger the picture must become before the text goes elsewhere. */
const kWorth = 1.2;

/** Whether the text is below a picture, which then is larger, and not beside it; as `before` where that hardly matters. */
export function is_below(picture: Size, room: Size, before: boolean | null): boolean {
  const scale = (width: number, height: number) => Math.min(width / picture.width, height / picture.height, 1);
  const below = scale(room.width, kPictureAbove * room.height);
  const beside = scale(room.width / 2, room.height);
  if (before === null) return below > beside;
  return before ? beside <= below * kWorth : below > beside * kWorth;
}
