/** A leader and two followers. */
export function Logo() {
  return (
    <svg className="logo" viewBox="0 0 32 32" aria-hidden="true">
      <rect width="32" height="32" rx="8" fill="var(--accent)" />
      <path d="M16 4.5 22.5 17h-13z" fill="var(--on-accent)" />
      <path d="M8.5 18 12 26H5zM23.5 18 27 26H20z" fill="#ffc94d" />
    </svg>
  );
}
