/** What an address of the class holds behind '#'. The studio doesn't import this file: its links hold projects there. */

/**
 * What stands behind '#': the code of the class, from a QR code, or the key of a teacher without a password. It is taken
 * out of the address, so that no shared link and no history holds it.
 */
export const secretInAddress = takeSecret();

function takeSecret(): string {
  const secret = decodeURIComponent(location.hash.slice(1));
  if (secret) history.replaceState(null, "", location.pathname + location.search);
  return secret;
}
